"""Lines of a log as they come in, in pieces of any size."""

from __future__ import annotations

import re
from typing import Final

from tickrig.host.monitor.heard import Heard
from tickrig.host.monitor.logs.log_line import parse_log_line
from tickrig.host.monitor.logs.tally import Tally
from tickrig.wire.can import CanFrame

_USUAL: Final = re.compile(
    r"\(([0-9]{1,12})\.([0-9]{6})\) ([!-~]{1,32}) ([0-7][0-9A-Fa-f]{2}|[01][0-9A-Fa-f]{7})"
    r"#((?:[0-9A-Fa-f]{2}){0,8})(?: ([RT]))?\r?",
    re.ASCII,
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
        self._rest, self._number = "", 0

    def push(self, data: bytes, /) -> list[Heard]:
        """Return the frames of the lines that end in these bytes."""
        lines = (self._rest + data.decode("latin-1")).split("\n")
        self._rest = lines.pop()
        return self._parse(lines)

    def finish(self) -> list[Heard]:
        """Return the frame of a last line without LF."""
        rest, self._rest = self._rest, ""
        return self._parse([rest]) if rest else []

    def _parse(self, lines: list[str]) -> list[Heard]:
        heard: list[Heard] = []
        usual, new, unhex, first = _USUAL.fullmatch, tuple.__new__, bytes.fromhex, self._number
        for number, line in enumerate(lines, first + 1):
            match = usual(line)
            if match is None:
                other = parse_log_line(line, number, self.tally)
                heard += (other,) if other else ()
                continue
            seconds, micros, channel, ident, data, direction = match.groups()
            extended = len(ident) == 8
            frame = new(CanFrame, (int(ident, 16), unhex(data), False, extended, 0))
            heard.append(new(Heard, (int(seconds + micros), channel, frame, direction == "T")))
        self._number = first + len(lines)
        return heard
