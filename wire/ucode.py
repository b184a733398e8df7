r"""Lines of an infra-red ucode reader: `$TYPE,FIELD,...*HHHH`. We define the protocol.

The source (NEDO report 3.4.43.3 (4), Fig. 123) names the reader but does not show its lines. HHHH
is the CRC-16 (XMODEM: 1021h, from 0) of all octets between `$` and `*`.

>>> UcodeLine(LineType.ROUND, (7, 2)).encode()
b'$UR,7,2*0FF7\n'
>>> parse_line(b"$UR,7,2*0FF7")
UcodeLine(type=<LineType.ROUND: 'UR'>, fields=(7, 2))
"""

from __future__ import annotations

import re
from binascii import crc_hqx
from dataclasses import dataclass
from enum import Enum
from typing import Final

from tickrig.wire.errors import ChecksumError, FieldError, FramingError

BAUD: Final = 38_400
ROUNDS: Final = 1 << 16
"""Number of rounds after which counting restarts at 0."""

MAX_LEVEL: Final = 100
_UCODE: Final = re.compile(r"[0-9A-Fa-f]{32}", re.ASCII)
# A field does not contain `$`, `,` or `*`, so two lines joined by a lost LF do not match.
_LINE: Final = re.compile(rb"\$([A-Z]{2}(?:,[0-9A-Za-z]*)*)\*([0-9A-F]{4})")


class LineType(Enum):
    """Kind of a line that a reader of ucodes (128-bit identifiers) sends.

    Attributes:
        READER: line after power-up and in answer to ID, with the version of the protocol, the range
            in mm, the cone in degrees, and 1 while the reader listens.
        UCODE: line for a received marker, with the number of the round, the ucode, and the level of
            the signal in per cent.
        ROUND: line for the end of a round, with the number of the round, and the number of markers
            received in it.
        LIGHT: line for the end of a round in which too much light made all markers unreadable, with
            the number of the round.
        REFUSED: line in answer to an invalid command.
    """

    READER = "UI"
    UCODE = "UC"
    ROUND = "UR"
    LIGHT = "UL"
    REFUSED = "UE"


HIGHEST: Final = {
    LineType.READER: (9, 99_999, 360, 1),
    LineType.UCODE: (ROUNDS - 1, None, MAX_LEVEL),
    LineType.ROUND: (ROUNDS - 1, 99),
    LineType.LIGHT: (ROUNDS - 1,),
    LineType.REFUSED: (),
}
"""Largest values of the fields of each kind of line, which start at 0, or None for a ucode."""

_COMMANDS: Final = (b"ID", b"ON", b"OFF")
"""Commands of a host, which are followed by LF: identify, start listening, stop listening."""


def parse_ucode(text: str) -> str:
    """Return a ucode in its normal form, 32 hex digits in capitals.

    A ucode is a number of 128 bits that identifies a place or a thing.

    Args:
        text: the ucode with hex digits in upper or lower case.

    Raises:
        FieldError: the text is not a ucode.

    >>> parse_ucode("00001c00000000000001000000000abc")
    '00001C00000000000001000000000ABC'
    """
    if not _UCODE.fullmatch(text):
        shown = text if len(text) <= 40 else f"{text[:40]}..."
        raise FieldError(f"ucode {shown!r} is not 32 hex digits")
    return text.upper()


@dataclass(frozen=True, slots=True)
class UcodeLine:
    """A line that a ucode reader sends.

    Attributes:
        type: kind of the line.
        fields: values of the line, whose limits are in `HIGHEST`. Ucodes are texts of 32 hex digits
            in capitals.

    Raises:
        FieldError: the fields do not fit the kind.
    """

    type: LineType
    fields: tuple[int | str, ...]

    def __post_init__(self) -> None:
        """Raise FieldError if the fields do not fit the kind."""
        highest = HIGHEST[self.type]
        if len(self.fields) != len(highest):
            raise FieldError(f"{self.type.value} has {len(highest)} fields, not {len(self.fields)}")
        for field, limit in zip(self.fields, highest, strict=True):
            if isinstance(field, str) != (limit is None):
                raise FieldError(f"{self.type.value}: {field!r} is out of its place")
            if isinstance(field, int) and limit is not None and not 0 <= field <= limit:
                raise FieldError(f"{self.type.value}: {field} is not in 0..{limit}")

    def encode(self) -> bytes:
        """Return the line with its sum and LF."""
        body = ",".join((self.type.value, *map(str, self.fields))).encode()
        return b"$%s*%04X\n" % (body, crc_hqx(body, 0))


def parse_line(line: bytes) -> UcodeLine:
    """Parse a line of a ucode reader, without its line end.

    Raises:
        FramingError: the line does not have the form of a reader's line.
        ChecksumError: the CRC is wrong.
        FieldError: the type of the line is unknown, or the fields do not fit the type.
    """
    if (match := _LINE.fullmatch(line)) is None:
        raise FramingError(f"no line of a ucode reader: {line[:60]!r}")
    body, told = match[1], int(match[2], 16)
    if (crc := crc_hqx(body, 0)) != told:
        raise ChecksumError(f"CRC {told:04X} of {body[:60]!r} is {crc:04X}")
    name, *words = body.decode().split(",")
    try:
        kind = LineType(name)
    except ValueError:
        raise FieldError(f"no kind of line: {name!r}") from None
    limits = HIGHEST[kind]
    if len(words) != len(limits):
        raise FieldError(f"{name} has {len(limits)} fields, not {len(words)}")
    return UcodeLine(kind, tuple(map(_field, words, limits)))


def _field(word: str, limit: int | None) -> int | str:
    if limit is None:
        return parse_ucode(word)
    # The length is checked before `int`, which would take long for a million digits.
    if not word.isdigit() or len(word) > len(str(limit)):
        raise FieldError(f"{word[:40]!r} is no number of 0..{limit}")
    return int(word)
