r"""Lines such as `DMIN:20;4`: what VV, PP and II tell of a sensor.

>>> encode_lines({"DMIN": "20"})
(b'DMIN:20;4',)
>>> parse_lines((b'DMIN:20;4',))
{'DMIN': '20'}
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from tickrig.wire.errors import ChecksumError, FieldError, FramingError
from tickrig.wire.sensors.scip.encoding import line_sum, with_sum


def encode_lines(values: Mapping[str, str]) -> tuple[bytes, ...]:
    """Return the lines; the semicolon is no part of the sum."""
    texts = [f"{key}:{value}".encode("latin-1") for key, value in values.items()]
    return tuple(with_sum(text + b";", text) for text in texts)


def parse_lines(lines: Iterable[bytes]) -> dict[str, str]:
    """Return the values by their keys.

    Raises:
        FramingError: a line that is none.
        ChecksumError: of a line.
    """
    values = {}
    for line in lines:
        text, semicolon, came = line.rpartition(b";")
        key, colon, value = text.decode("latin-1").partition(":")
        if not (semicolon and colon):
            raise FramingError(f"line {line!r} is not KEY:VALUE;SUM")
        if came != line_sum(text):
            raise ChecksumError(f"line {line!r}: its sum is {line_sum(text)!r}")
        values[key] = value.strip()
    return values


@dataclass(frozen=True, slots=True)
class Specification:
    """What PP tells: limits in mm, steps, turns per minute.

    Attributes:
        model: its name.
        nearest_mm: DMIN.
        farthest_mm: DMAX.
        resolution: ARES, steps of a whole turn.
        first: AMIN, the first step that measures.
        last: AMAX, the last one.
        front: AFRT, the step straight ahead.
        speed_rpm: SCAN.
    """

    model: str
    nearest_mm: int
    farthest_mm: int
    resolution: int
    first: int
    last: int
    front: int
    speed_rpm: int

    @property
    def lines(self) -> tuple[bytes, ...]:
        """The lines of a reply to PP."""
        numbers = (self.nearest_mm, self.farthest_mm, self.resolution)
        steps = (self.first, self.last, self.front, self.speed_rpm)
        keys = ("DMIN", "DMAX", "ARES", "AMIN", "AMAX", "AFRT", "SCAN")
        values = dict(zip(keys, map(str, (*numbers, *steps)), strict=True))
        return encode_lines({"MODL": self.model, **values})

    @classmethod
    def parse(cls, lines: Iterable[bytes]) -> Specification:
        """Read a reply to PP.

        Raises:
            WireError: a line that is none, or a number that is missing, none or below 0.
        """
        values = parse_lines(lines)
        numbers = []
        for key in ("DMIN", "DMAX", "ARES", "AMIN", "AMAX", "AFRT", "SCAN"):
            text = values.get(key, "")
            if not (text.isascii() and text.isdecimal()):
                raise FieldError(f"{key} {text!r} is not a whole number")
            numbers.append(int(text))
        return cls(values.get("MODL", ""), *numbers)
