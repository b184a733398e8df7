r"""SCIP of scanning range finders: commands, replies, scans, descriptions; 2.0 and 1.1.

Numbers as characters of 6 bits each, and the checksum after each line (SCIP 2.0, data encoding).

>>> encode_number(1_234, 2), encode_number(5_432, 3), encode_number(16_000_000, 4)
(b'CB', b'1Dh', b'm2@0')
>>> with_sum(b"DMIN:20;", b"DMIN:20")
b'DMIN:20;4'

Commands of a host: symbol, parameters, and a string that the reply repeats.

>>> Command.parse(b"GD0044072501;left")
Command(symbol='GD', parameters='0044072501', string=';left')
>>> Command("TM", "0").encode()
b'TM0\n'

The data of a scan: time stamp, and distances in blocks of 64 characters, each with its checksum.

>>> encode_scan(16_000_000, [5_432], 3)
(b'm2@0?', b'1DhM')
>>> parse_scan((b'm2@0?', b'1DhM'), 3)
(16000000, (5432,))

SCIP 1.1, the protocol of a URG-04LX after power-up. SCIP 1.1 has no checksums. A status has one
character, and a distance has two.

Sources: HokuyoAIST, urg_nz (gearbox) and urg_library as hosts; two recordings of real sensors
(`tests/golden/scip_urg_04lx.json`). The document itself is no longer public.

>>> encode_reply(b"L1", SCIP1_OK)
b'L1\n0\n\n'
>>> encode_reply(b"G38438401", SCIP1_OK, encode_distances([1_234]))
b'G38438401\n0\nCB\n\n'

Replies of a sensor: echo, status, lines of data, an empty line.

>>> Reply(b"BM", "00").encode()
b'BM\n00P\n\n'
>>> ReplySplitter().push(b"BM\n00P\n\n")
[Reply(echo=b'BM', status='00', lines=())]

Lines such as `DMIN:20;4`: the replies to VV, PP and II.

>>> encode_lines({"DMIN": "20"})
(b'DMIN:20;4',)
>>> parse_lines((b'DMIN:20;4',))
{'DMIN': '20'}
"""

from __future__ import annotations

import struct
from binascii import a2b_base64, b2a_base64
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from string import ascii_letters, digits
from typing import Final

from tickrig._compiled import mypyc_attr
from tickrig.wire.errors import ChecksumError, FieldError, FramingError, WireError

# Status codes of replies (SCIP 2.0, sensor commands and response to invalid commands).

OK: Final = "00"
DATA: Final = "99"
"""Status after the echo of a scan of MD or MS."""

REPEATED: Final = "0B"
TOO_SHORT: Final = "0C"
TOO_LONG: Final = "0D"
UNKNOWN: Final = "0E"
STRING_TOO_LONG: Final = "0G"
STRING_LETTERS: Final = "0H"

LASER_OFF: Final = "10"
LASER_TROUBLE: Final = "50"
MOTOR_TROUBLE: Final = "51"
"""Statuses of hardware faults, which are 50..97. The assignment is our choice."""


_BITS: Final = 6
_MASK: Final = 0x3F
_ZERO: Final = 0x30
_CHARACTERS: Final = bytes(range(_ZERO, _ZERO + _MASK + 1))

_BASE64: Final = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"
"""Base64 characters of 6 bits; with them encoding is five times as fast as by shifts and masks."""

_FROM_BASE64: Final = bytes.maketrans(_BASE64, _CHARACTERS)
_TO_BASE64: Final = bytes.maketrans(_CHARACTERS, _BASE64)
_MOST: Final = 4
"""Largest number of characters of a number."""


def encode_numbers(values: Sequence[int], width: int) -> bytes:
    """Encode numbers in the notation of SCIP, the protocol of URG sensors.

    Args:
        values: the numbers.
        width: number of characters of each number, 1 to 4. A character has 6 bits.

    Raises:
        FieldError: a number needs more characters.
    """
    for value in (min(values, default=0), max(values, default=0)):
        if not 0 <= value < 1 << _BITS * width:
            raise FieldError(f"{value} does not fit into {width} characters of 6 bits")
    # Each number has four bytes. Without the top byte it has 24 bits, which are four characters of
    # 6 bits, as in base64. So `b2a_base64` does in C the work of shifts.
    words = bytearray(struct.pack(f">{len(values)}I", *values))
    del words[::_MOST]
    characters = b2a_base64(words, newline=False).translate(_FROM_BASE64)
    out = bytearray(len(values) * width)
    for place in range(width):
        out[place::width] = characters[_MOST - width + place :: _MOST]
    return bytes(out)


def parse_numbers(data: bytes, width: int) -> tuple[int, ...]:
    """Decode numbers from the notation of SCIP, the protocol of URG sensors.

    Args:
        data: the characters of all numbers.
        width: number of characters of each number, 1 to 4. A character has 6 bits.

    Raises:
        FieldError: a character is invalid.
        FramingError: the number at the end is incomplete.
    """
    # Check before base64: `a2b_base64` skips characters that it does not know.
    if strange := data.translate(None, _CHARACTERS):
        raise FieldError(f"character {strange[0]:#04x} is not in 0x30..0x6f")
    if len(data) % width:
        raise FramingError(f"{len(data)} characters are no numbers of {width}")
    count = len(data) // width
    characters = bytearray(_BASE64[:1] * (_MOST * count))
    for place in range(width):
        characters[_MOST - width + place :: _MOST] = data[place::width].translate(_TO_BASE64)
    words, bytes_of_three = bytearray(_MOST * count), a2b_base64(characters)
    for place in range(3):
        words[place + 1 :: _MOST] = bytes_of_three[place::3]
    return struct.unpack(f">{count}I", words)


def encode_number(value: int, width: int) -> bytes:
    """Return a number in `width` characters; raise FieldError if it needs more characters."""
    return encode_numbers((value,), width)


def parse_number(data: bytes) -> int:
    """Return the number in all characters; raise FieldError if a character is invalid."""
    return parse_numbers(data, len(data))[0]


def _line_sum(data: bytes) -> bytes:
    """Return the checksum character of a line."""
    return bytes((_ZERO + (sum(data) & _MASK),))


def with_sum(line: bytes, summed: bytes | None = None) -> bytes:
    """Append the checksum character of SCIP to a line, and return the result.

    Args:
        line: the line.
        summed: text over which the checksum is computed, or None for the whole line.
    """
    return line + _line_sum(line if summed is None else summed)


def without_sum(line: bytes) -> bytes:
    """Return a line without its checksum.

    Raises:
        ChecksumError: the checksum is wrong.
    """
    data, came = line[:-1], line[-1:]
    if not came or came != _line_sum(data):
        raise ChecksumError(f"line {line!r}: its sum is {_line_sum(data)!r}")
    return data


_SYMBOL_BYTES: Final = 2
MOST_STRING: Final = 16
"""Largest number of letters of a string (SCIP 2.0, communication format)."""

LETTERS: Final = frozenset(ascii_letters + digits + " ._+@")

SIZES: Final[Mapping[str, tuple[int, ...]]] = {
    "MD": (4, 4, 2, 1, 2),
    "MS": (4, 4, 2, 1, 2),
    "GD": (4, 4, 2),
    "GS": (4, 4, 2),
    "BM": (),
    "QT": (),
    "RS": (),
    "TM": (1,),
    "SS": (6,),
    "CR": (2,),
    "HS": (1,),
    "VV": (),
    "PP": (),
    "II": (),
}
"""Numbers of characters of the parameters, by command."""


@dataclass(frozen=True, slots=True)
class Command:
    """A command of SCIP 2.0 for a URG sensor. It is not validated.

    Attributes:
        symbol: symbol of two letters, such as `MD`.
        parameters: all parameters, one after the other.
        string: semicolon and a text that the host may add to the command. The sensor repeats the
            text in its reply. `string` is empty if the host adds no text.
    """

    symbol: str
    parameters: str = ""
    string: str = ""

    @classmethod
    def parse(cls, line: bytes) -> Command:
        """Read a line without its end."""
        text = line.decode("latin-1")
        head, semicolon, rest = text.partition(";")
        return cls(head[:_SYMBOL_BYTES], head[_SYMBOL_BYTES:], semicolon + rest)

    @property
    def echo(self) -> bytes:
        """The line at the start of a reply."""
        return f"{self.symbol}{self.parameters}{self.string}".encode("latin-1")

    @property
    def fields(self) -> tuple[str, ...]:
        """The separate parameters, split according to `SIZES`."""
        out, at = [], 0
        for size in SIZES[self.symbol]:
            out.append(self.parameters[at : at + size])
            at += size
        return tuple(out)

    def encode(self) -> bytes:
        """Return the bytes on the line."""
        return self.echo + b"\n"


_TIME_WIDTH: Final = 4
_BLOCK_BYTES: Final = 64
WIDTHS: Final = {"D": 3, "S": 2}
"""Number of characters of a distance, by the second letter of the command."""


def encode_scan(time_ms: int, distances: Sequence[int], width: int) -> tuple[bytes, ...]:
    """Return the lines with the data of a scan, which follow the status in a reply of SCIP 2.0.

    Args:
        time_ms: time stamp of the scan, in ms.
        distances: distances in mm.
        width: number of characters of a distance.

    Raises:
        FieldError: a number does not fit into its characters.
    """
    data = encode_numbers(distances, width)
    blocks = [data[at : at + _BLOCK_BYTES] for at in range(0, len(data), _BLOCK_BYTES)]
    return tuple(with_sum(line) for line in (encode_number(time_ms, _TIME_WIDTH), *blocks))


def parse_scan(lines: Sequence[bytes], width: int) -> tuple[int, tuple[int, ...]]:
    """Return the time stamp in ms and the distances in mm from the data lines of a scan.

    Args:
        lines: lines after the status of a reply.
        width: number of characters of a distance.

    Raises:
        ChecksumError: the checksum of a line is wrong.
        FramingError: there is no time stamp, or a distance is incomplete.
        FieldError: a character is invalid.
    """
    # Each line has a sum of its own, and a distance may be split between two blocks of 64
    # characters. So remove the sums first, join the blocks, then cut the distances.
    stamp, *blocks = [without_sum(line) for line in lines] or [b""]
    data = b"".join(blocks)
    if len(stamp) != _TIME_WIDTH:
        raise FramingError(f"{len(stamp)} characters of time, not {_TIME_WIDTH}")
    return parse_number(stamp), parse_numbers(data, width)


SWITCH: Final = b"SCIP2.0"
"""The command that switches a sensor to SCIP 2.0 until power-off."""

SCIP1_OK: Final = b"0"
ERROR: Final = b"E"
"""Status in the answer to QT, by which hosts detect SCIP 1.1. Any status except 0 is an error."""

_WIDTH: Final = 2
FARTHEST_MM: Final = 4_095
"""Largest distance in mm, which is the largest number in two characters."""


def encode_reply(echo: bytes, status: bytes, lines: Iterable[bytes] = ()) -> bytes:
    """Return the bytes on the line."""
    return b"\n".join((echo, status, *lines)) + b"\n\n"


def encode_distances(distances: Sequence[int]) -> tuple[bytes, ...]:
    """Return the data lines of the answer to a G command of SCIP 1.1, without checksums.

    Raises:
        FieldError: a distance does not fit into its characters.
    """
    data = encode_numbers(distances, _WIDTH)
    return tuple(data[at : at + _BLOCK_BYTES] for at in range(0, len(data), _BLOCK_BYTES))


_END: Final = b"\n\n"
_STATUS_BYTES: Final = 2
MOST_BYTES: Final = 16_384
"""Largest size of a reply in bytes; a whole scan has less than 3000 bytes."""


@dataclass(frozen=True, slots=True)
class Reply:
    """A reply of a URG sensor in SCIP 2.0.

    Attributes:
        echo: command that is answered. In replies with scans it contains the number of remaining
            scans.
        status: status of two characters.
        lines: lines after the status, as received, each with its checksum.
    """

    echo: bytes
    status: str
    lines: tuple[bytes, ...] = ()

    def encode(self) -> bytes:
        """Return the bytes on the line."""
        # MD0044072501001 LF 99b LF time stamp, sum LF block, sum LF ... LF LF. The echo has no sum.
        return b"\n".join((self.echo, with_sum(self.status.encode()), *self.lines)) + _END

    @classmethod
    def parse(cls, data: bytes) -> Reply:
        """Parse a reply of a sensor.

        Args:
            data: the reply without its last two line ends.

        Raises:
            FramingError: there is no echo or no status.
            ChecksumError: the checksum of the status is wrong.
        """
        echo, *rest = data.split(b"\n")
        if not rest:
            raise FramingError(f"{data!r} has no status")
        # SCIP2.0 LF 0 LF LF: still in SCIP 1.1, so its status has one character and no sum.
        if (echo, rest) == (SWITCH, [SCIP1_OK]):
            return cls(echo, SCIP1_OK.decode())  # the last answer in SCIP 1.1
        status = without_sum(rest[0])
        if len(status) != _STATUS_BYTES or not status.isascii():
            raise FramingError(f"status {status!r} has not 2 characters")
        return cls(echo, status.decode(), tuple(rest[1:]))


@mypyc_attr(serializable=True)
class ReplySplitter:
    """Splits a stream of received bytes into replies of a URG sensor (SCIP).

    The bytes may be divided into chunks in any way.

    Attributes:
        garbled: number of invalid replies, which were dropped.
    """

    def __init__(self) -> None:
        self._tail = b""
        self.garbled = 0

    def push(self, data: bytes) -> list[Reply]:
        """Add received bytes; return completed replies."""
        # LF LF ends a reply and cannot occur inside: no line of a reply is empty.
        *whole, self._tail = (self._tail + data).split(_END)
        if len(self._tail) > MOST_BYTES:
            self._tail, self.garbled = b"", self.garbled + 1
        out = []
        for part in whole:
            try:
                out.append(Reply.parse(part))
            except WireError:
                self.garbled += 1
        return out


def encode_lines(values: Mapping[str, str]) -> tuple[bytes, ...]:
    """Return `KEY:VALUE;` lines with checksums, as in the replies to the commands VV, PP and II.

    The checksum of a line does not include the semicolon.
    """
    texts = [f"{key}:{value}".encode("latin-1") for key, value in values.items()]
    return tuple(with_sum(text + b";", text) for text in texts)


def parse_lines(lines: Iterable[bytes]) -> dict[str, str]:
    """Read `KEY:VALUE;` lines with checksums, as in the replies to the commands VV, PP and II.

    Returns:
        The values by key.

    Raises:
        FramingError: a line is invalid.
        ChecksumError: the checksum of a line is wrong.
    """
    values = {}
    for line in lines:
        text, semicolon, came = line.rpartition(b";")
        key, colon, value = text.decode("latin-1").partition(":")
        if not (semicolon and colon):
            raise FramingError(f"line {line!r} is not KEY:VALUE;SUM")
        if came != _line_sum(text):
            raise ChecksumError(f"line {line!r}: its sum is {_line_sum(text)!r}")
        values[key] = value.strip()
    return values


@dataclass(frozen=True, slots=True)
class Specification:
    """The specification of a URG sensor, as in the reply to PP: range, steps and speed.

    A step is one direction of the beam.

    Attributes:
        model: name of the model.
        nearest_mm: smallest distance that the sensor measures (DMIN).
        farthest_mm: largest distance that the sensor measures (DMAX).
        resolution: number of steps in a whole turn (ARES).
        first: first step that measures (AMIN).
        last: last step that measures (AMAX).
        front: step that is straight ahead (AFRT).
        speed_rpm: speed in turns per minute (SCAN).
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
        """Read the specification of a sensor from the lines of its reply to PP.

        Raises:
            WireError: a line is invalid, or a number is missing, invalid or below 0.
        """
        values = parse_lines(lines)
        numbers = []
        for key in ("DMIN", "DMAX", "ARES", "AMIN", "AMAX", "AFRT", "SCAN"):
            text = values.get(key, "")
            if not (text.isascii() and text.isdecimal()):
                raise FieldError(f"{key} {text!r} is not a whole number")
            numbers.append(int(text))
        return cls(values.get("MODL", ""), *numbers)
