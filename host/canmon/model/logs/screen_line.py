"""Lines that candump, `canmon dump` and python-can show on a screen, with or without time.

>>> tally, clock = mark.LogTally(), ScreenClock()
>>> shown = "(000.000250)  can0  TX - -  705   [1]  7F   '.'"
>>> record = parse_screen_line(shown, tally, clock)
>>> record.at_us, record.channel, str(record.frame), record.sent
(250, 'can0', '705#7F', True)
"""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Final

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs import mark
from tickrig.host.canmon.model.logs.notation import UNNAMED, parse_frame
from tickrig.wire.can import BRS, ERROR_FLAG, ESI, MAX_DATA_BYTES
from tickrig.wire.errors import WireError

HEAD: Final = 1 << 13
"""Bytes of a text by which it is told what its stamps are."""

_LATE_US: Final = 10_000
"""Frames of several buses are shown out of order by less."""

_STAMP: Final = (
    r"\((?:(-?)([0-9]{1,12})|([0-9]{4}-[0-9]{2}-[0-9]{2} [0-9]{2}:[0-9]{2}:[0-9]{2}))"
    r"\.([0-9]{1,9})\)\s+"
)
_FRAME: Final = re.compile(
    rf"(?:{_STAMP})?(\S{{1,32}})\s+(?:([RT])X ([-B]) ([-E])\s+)?"
    r"([0-9A-Fa-f]{8}|[0-9A-Fa-f]{3})\s+(\[[0-9]{1,4}\]|\{[0-9A-F]\})(?:\s+(.*))?",
    re.ASCII,
)
_PRINTED: Final = re.compile(
    r"Timestamp:\s+(-?)([0-9]{1,12})\.([0-9]{6})\s+ID:\s+([0-9a-f]{3,8})\s+"
    r"([SX])(?: ([RT])x)? ([E ]) ([R ]) ([F ]) (BS|  ) (EI|  )\s+DLC?:\s+([0-9]{1,2})(?!\S)"
    r"((?: {1,4}[0-9a-f]{2}(?!\S))*)(?:\s+'\w+')?(?:\s+Channel: (\S{1,32}))?",
    re.ASCII,
)
"""What python-can prints, and its logger writes to a file with any other ending."""
_SERIAL: Final = re.compile(rf"(?:{_STAMP})?\S+  [<>]  .*", re.ASCII)
_WORDS: Final = re.compile(r"\t+[a-z]+-[a-z-]+(?:\{.*\})?\s*", re.ASCII)
_COLOUR: Final = re.compile(r"\x1b\[[0-9;]*m")
_SPANS: Final = re.compile(
    r"^[ \t]*+\((-?)([0-9]{3,9})\.([0-9]{6})\)[ \t]++\S++\s.*\[[0-9]", re.ASCII | re.MULTILINE
)
_DIGITS: Final = re.compile(r"[0-9A-Fa-f]{2}")
_BITS: Final = re.compile(r"[01]{8}")
_SWAPPED: Final = "`"
"""Between bytes that candump shows from the last to the first."""
_ABSOLUTE: Final = 10
"""Digits of the seconds since the epoch; with fewer it is a span of time."""


_WRAP_US: Final = 1 << 32
"""So far a counter of microseconds with 32 bits goes."""


class ScreenClock:
    """Tells the time of a frame from the stamp before it.

    Args:
        deltas: spans count from the frame before (`-t d`), not from the first (`-t z`).

    Attributes:
        shift_us: what is added to a counter of microseconds, so that no time is below 0.
    """

    def __init__(self, deltas: bool = False) -> None:
        self.deltas, self._now_us = deltas, 0
        self.shift_us = 0
        self._count: int | None = None

    @classmethod
    def of(cls, text: str) -> ScreenClock:
        """Return the clock of a text: of deltas, where its first spans fall often or by much."""
        head = text if len(text) <= HEAD else text[: text.rfind("\n", 0, HEAD) + 1]
        spans = [int(f"{sign}{high}{low}") for sign, high, low in _SPANS.findall(head)]
        falls = [before - after for before, after in pairwise(spans) if after < before]
        return cls(len(falls) * 4 > len(spans) or max(falls, default=0) > _LATE_US)

    def at_us(self, sign: str, seconds: str | None, date: str | None, fraction: str | None) -> int:
        """Return the time of a stamp; of the frame before, where there is none.

        Raises:
            ValueError: a date that there is not.
        """
        micros = int(f"{fraction or '':0<6.6}")
        if date is not None:
            from datetime import datetime  # noqa: PLC0415 - seldom wanted

            self._now_us = int(datetime.fromisoformat(date).timestamp()) * 1_000_000 + micros
        elif seconds is not None:
            span_us = int(f"{sign}1") * (int(seconds) * 1_000_000 + micros)
            before_us = self._now_us if self.deltas and len(seconds) < _ABSOLUTE else 0
            self._now_us = max(0, before_us + span_us)
        return self._now_us

    def counted_us(self, count: int) -> int:
        """Return the time of a counter of microseconds, as an adapter has it.

        One that begins below 0 begins at 0; one of 32 bits that overflows, with a sign or without,
        goes on.
        """
        before = self._count
        if before is None:
            self.shift_us = max(0, -count)
        elif before - count > _WRAP_US // 2 and before < _WRAP_US:
            self.shift_us += _WRAP_US
        self._count = count
        return max(0, count + self.shift_us)


def parse_screen_line(line: str, tally: mark.LogTally, clock: ScreenClock) -> Record | str | None:
    """Return a frame, what was counted or is no fault instead, or None for a bad line."""
    text = _COLOUR.sub("", line).strip() if "\x1b" in line else line.strip()
    match = _FRAME.fullmatch(text)
    if match is None:
        return _beside(line, text, tally, clock)
    sign, seconds, date, fraction, channel, direction, brs, esi, *data = match.groups()
    ident, size, shown = data
    digits = size[1:-1]
    if len(digits) > len("08"):
        tally.passed_over[mark.CAN_XL] += 1
        return mark.CAN_XL
    length = int(digits) if size.startswith("[") else min(int(digits, 16), MAX_DATA_BYTES)
    flags = f"#{BRS * (brs == 'B') | ESI * (esi == 'E')}" * (len(digits) == len("08"))
    try:
        frame = parse_frame(f"{ident}#{flags}{_notation(length, shown or '')}")
        at_us = clock.at_us(sign, seconds, date, fraction)
    except (WireError, ValueError, OverflowError, OSError):
        return None
    tally.untimed += fraction is None
    return Record(at_us, channel, frame, direction == "T")


def _beside(line: str, text: str, tally: mark.LogTally, clock: ScreenClock) -> Record | str | None:
    """Return what other lines of a screen say.

    These are lines of serial ports, error frames in words, frames that candump says were dropped,
    and frames that python-can prints.
    """
    if _SERIAL.fullmatch(text):
        tally.passed_over[mark.SERIAL_LINES] += 1
        return mark.SERIAL_LINES
    if text.startswith(mark.DROP_COUNT) and (lost := mark.lost_frames(text)):
        tally.lost += lost
        return text
    if match := _PRINTED.fullmatch(text):
        return _printed(match, clock)
    return text if _WORDS.fullmatch(line) else None


def _printed(match: re.Match[str], clock: ScreenClock) -> Record | None:
    """Return the frame of a line that python-can printed."""
    sign, seconds, fraction, ident, kind, direction, *flags, length, data, channel = match.groups()
    error, remote, fd, brs, esi = (not flag.isspace() for flag in flags)
    digits = "".join(data.split())
    if error:
        notation = f"{ERROR_FLAG | int(ident, 16):08X}#{digits}"
    else:
        shown = f"R{length}" if remote else f"#{BRS * brs | ESI * esi}{digits}" if fd else digits
        notation = f"{int(ident, 16):0{8 if kind == 'X' else 3}X}#{shown}"
    try:
        frame = parse_frame(notation)
    except WireError:
        return None
    if not (error or remote) and len(frame.data) != int(length):
        return None
    at_us = clock.at_us(sign, seconds, None, fraction)
    return Record(at_us, channel or UNNAMED, frame, direction == "T")


def _notation(length: int, shown: str) -> str:
    """Return data in the notation of a log; what stands behind them is passed over."""
    if shown.startswith("remote request"):
        return f"R{length}"
    words = shown.split()
    if words and _SWAPPED in words[0]:
        words = words[0].split(_SWAPPED)[::-1]
    digits = [f"{int(word, 2):02X}" if _BITS.fullmatch(word) else word for word in words[:length]]
    if len(digits) < length or not all(map(_DIGITS.fullmatch, digits)):
        raise ValueError(f"{shown!r} is not {length} bytes")
    return "".join(digits)
