"""Lines of a log as they come in, in pieces of any size."""

from __future__ import annotations

import re
from typing import Final

from tickrig.host.monitor.frames.heard import Heard
from tickrig.host.monitor.logs.reading.log_line import parse_log_line
from tickrig.host.monitor.logs.reading.screen_line import ScreenClock
from tickrig.host.monitor.logs.reading.whole_lines import WholeLines
from tickrig.host.monitor.logs.tally import Tally
from tickrig.wire.can import CanFrame

_USUAL: Final = re.compile(
    r"^\(([0-9]{1,12})\.([0-9]{6})\) ([!-~]{1,32}) ([0-7][0-9A-Fa-f]{2}|[01][0-9A-Fa-f]{7})"
    r"#((?:[0-9A-Fa-f]{2}){0,8})(?: ([RT]))?\r?$",
    re.ASCII | re.MULTILINE,
)
"""A line with a data frame, as candump writes it: nearly all are so."""


class LogLines:
    """A decoder of a log in text: `push` what has come in, `finish` at its end.

    Bytes that are no ASCII make a line bad; they never raise.

    Attributes:
        tally: what was no frame.
    """

    def __init__(self) -> None:
        self.tally = Tally()
        self._whole, self._number = WholeLines(), 0
        self._clock: ScreenClock | None = None

    @property
    def deltas(self) -> bool:
        """Whether stamps count from frame to frame: only all of the log tells the time."""
        return self._clock is not None and self._clock.deltas

    def push(self, data: bytes, /) -> list[Heard]:
        """Return the frames of the lines that end in these bytes."""
        lines = self._whole.push(data)
        return self._frames(lines[:-1].decode("latin-1")) if lines else []

    def finish(self) -> list[Heard]:
        """Return the frame of a last line without LF."""
        rest = self._whole.finish()
        return self._frames(rest.decode("latin-1")) if rest else []

    def _frames(self, text: str) -> list[Heard]:
        count, begin = text.count("\n") + 1, self._number
        self._number += count
        usual = _USUAL.findall(text)
        if len(usual) == count:
            return _usual_frames(usual)
        clock = self._clock = self._clock or ScreenClock.of(text)
        lines = enumerate(text.split("\n"), begin + 1)
        frames = (parse_log_line(line, number, self.tally, clock) for number, line in lines)
        return [heard for heard in frames if heard]


def _usual_frames(lines: list[tuple[str, str, str, str, str, str]]) -> list[Heard]:
    """Return the frames of what `_USUAL` found; made without the constructors, for speed."""
    heard: list[Heard] = []
    add, new, unhex = heard.append, tuple.__new__, bytes.fromhex
    second, second_us, idents = "", 0, dict[str, tuple[int, bool]]()
    for seconds, micros, channel, ident, data, direction in lines:
        if seconds != second:
            second, second_us = seconds, int(seconds) * 1_000_000
        if ident not in idents:
            idents[ident] = int(ident, 16), len(ident) == 8
        can_id, extended = idents[ident]
        frame = new(CanFrame, (can_id, unhex(data), False, extended, 0))
        add(new(Heard, (second_us + int(micros), channel, frame, direction == "T")))
    return heard
