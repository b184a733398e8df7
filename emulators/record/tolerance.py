"""What still counts as the same when a recording is compared with an emulator."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Final

DRIFT: Final = 2_000
"""Two clocks part by less than one in so many: 500 ppm."""

ROUNDING: Final = 1e-9
"""1.1 - 1.0 is a little more than 0.1."""

_RULE: Final = re.compile(
    r"(.+?)(?:\[([0-9]{1,4}):([0-9]{1,4})\])?=([0-9]{1,12}(?:\.[0-9]{1,9})?)(%)?"
)
_NUMBER: Final = re.compile(r"(?<![\w.])[+-]?[0-9]{1,18}(?:\.[0-9]{1,9})?(?![\w.])")
_KIND: Final = re.compile(r"[A-Za-z]\w*:|[0-9A-F]{3}#|[0-9A-F]{8}#", re.ASCII)


@dataclass(frozen=True, slots=True)
class NumberRule:
    """Numbers in lines of a pattern may differ.

    Attributes:
        pattern: as file names have it: `EV:batt*`, `181#*`.
        least: by how much at most; of 100, where it is a share.
        share: it is in percent of the recorded number.
        place: of the field, None for all decimal numbers of the line: characters of a line of
            text, which are hex digits; data bytes of a frame, the lowest first.
    """

    pattern: str
    least: float
    share: bool = False
    place: tuple[int, int] | None = None

    def allows(self, recorded: str, emulated: str) -> bool:
        """Say whether two lines differ in such numbers alone, and by no more."""
        if not (fnmatchcase(recorded, self.pattern) and fnmatchcase(emulated, self.pattern)):
            return False
        split = _split_numbers if self.place is None else self._split_field
        (frame, old), (other, new) = split(recorded), split(emulated)
        if frame != other or len(old) != len(new) or not old:
            return False
        return all(self._near(a, b) for a, b in zip(old, new, strict=True))

    def _near(self, recorded: float, emulated: float) -> bool:
        least = abs(recorded) * self.least / 100 if self.share else self.least
        return abs(recorded - emulated) <= least + ROUNDING

    def _split_field(self, text: str) -> tuple[str, list[float]]:
        """Return a line without its field, and the number in that."""
        assert self.place is not None
        first, last = self.place
        head, hash_, data = text.partition("#")
        if hash_ and _KIND.match(text):
            digits = data[2 * first : 2 * last]
            rest = f"{head}#{data[: 2 * first]}_{data[2 * last :]}"
            return rest, _little_endian(digits)
        digits = text[first:last]
        try:
            return f"{text[:first]}_{text[last:]}", [int(digits, 16)]
        except ValueError:
            return text, []


def _little_endian(digits: str) -> list[float]:
    try:
        return [int.from_bytes(bytes.fromhex(digits), "little", signed=True)] if digits else []
    except ValueError:
        return []


def _split_numbers(text: str) -> tuple[str, list[float]]:
    """Return a line with its decimal numbers taken out, and these."""
    return _NUMBER.sub("_", text), [float(number) for number in _NUMBER.findall(text)]


def parse_number_rule(text: str) -> NumberRule:
    """Read `PATTERN=TOLERANCE`, `PATTERN[FROM:TO]=TOLERANCE`, with % for a share.

    Raises:
        ValueError: it is none.

    >>> parse_number_rule("EV:batt*=5").allows("EV:batt 98", "EV:batt 95")
    True
    >>> parse_number_rule("181#*[2:4]=1%").allows("181#3702E803", "181#3702F203")
    True
    """
    match = _RULE.fullmatch(text)
    if match is None or (match[2] and int(match[2]) >= int(match[3])):
        raise ValueError(f"{text!r} is not PATTERN=TOLERANCE or PATTERN[FROM:TO]=TOLERANCE")
    place = (int(match[2]), int(match[3])) if match[2] else None
    return NumberRule(match[1], float(match[4]), bool(match[5]), place)


@dataclass(frozen=True, slots=True)
class Tolerance:
    """What counts as the same.

    Attributes:
        time_us: how far a time may be off; the drift of two clocks is added.
        numbers: how far numbers may be.
        ignored: patterns of lines that are not compared.
        kinds: patterns of lines that are independent of all others: they need not come in the
            order in which they were recorded.
    """

    time_us: int
    numbers: Sequence[NumberRule] = ()
    ignored: Sequence[str] = ()
    kinds: Sequence[str] = ()

    def allowed_us(self, at_us: int) -> int:
        """Return how far a time may be off, so long after the begin."""
        return self.time_us + at_us // DRIFT

    def same(self, recorded: str, emulated: str) -> bool:
        """Say whether two lines say the same."""
        return recorded == emulated or any(rule.allows(recorded, emulated) for rule in self.numbers)

    def ignores(self, text: str) -> bool:
        """Say whether a line is not compared."""
        return any(fnmatchcase(text, pattern) for pattern in self.ignored)

    def kind(self, text: str) -> str:
        """Return what keeps its order: lines up to a colon, frames of a CAN-ID, or a pattern."""
        for pattern in self.kinds:
            if fnmatchcase(text, pattern):
                return pattern
        match = _KIND.match(text)
        return match[0][:-1] if match else ""
