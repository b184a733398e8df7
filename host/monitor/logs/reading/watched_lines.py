"""Lines of a text file that somebody else reads: which of them came to nothing."""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator
from typing import Final, TextIO

from tickrig.host.monitor.logs.log_format import LogFormat
from tickrig.host.monitor.logs.tally import OTHER_LINES, Tally

_SILENT: Final = {
    LogFormat.ASC: re.compile(
        r"\s*(?:$|//|date\b|base\b|(?:no\s+)?internal\s+events|(?:begin|end)\s+triggerblock"
        r"|[0-9]+\.[0-9]+\s+(?:Start of measurement|//))",
        re.IGNORECASE,
    ),
    LogFormat.TRC: re.compile(r"\s*(?:$|;)"),
}
"""Headers, comments and empty lines."""

_EVENTS: Final = {
    LogFormat.ASC: re.compile(
        r"\s*[0-9]+\.[0-9]+\s+(?!CANFD\b|[0-9]+\s+(?:[0-9A-F]+x?|ErrorFrame)\b)\S", re.IGNORECASE
    ),
    LogFormat.TRC: re.compile(
        r"\s*[0-9]+\)?\s+[0-9.]+\s+(?:[0-9]+\s+)?(?:Warng|Error|ST|ER|EC|EV|F{8})\b"
    ),
}
"""Lines with what is no data or remote frame. What is neither of these was meant as a frame."""


class WatchedLines(Iterator[str]):
    """A file for a reader that takes line after line.

    A reader that raises may be started again: it finds an empty line first, for
    readers take a first line as header, and then what follows the bad one.

    Attributes:
        ended: the file has no more lines.
    """

    def __init__(self, file: TextIO, kind: LogFormat, tally: Tally) -> None:
        self._file, self._silent, self._event = file, _SILENT[kind], _EVENTS[kind]
        self._tally = tally
        self._line, self._number, self._again, self.ended = "", 0, False, False

    def __next__(self) -> str:
        """Return the next line; the one before it came to nothing if it was not taken."""
        if self._again:
            self._again = False
            return "\n"
        self._pass_over()
        try:
            self._line = next(self._file)
        except StopIteration:
            self.ended = True
            raise
        self._number += 1
        return self._line

    def _pass_over(self) -> None:
        """Count the latest line, if it was not taken."""
        line, self._line = self._line, ""
        if self._silent.match(line):
            return
        if self._event.match(line):
            self._tally.passed_over[OTHER_LINES] += 1
        else:
            self._tally.bad_lines.add(self._number, line.rstrip("\r\n"))

    def taken(self) -> None:
        """Note that the latest line came to a frame."""
        self._line = ""

    def refused(self, error: Exception) -> None:
        """Note that the latest line is none of the log; raise what is wrong with the file.

        A reader that refuses the empty line it was started with lacks something before it.
        """
        if self.ended or not self._line or isinstance(error, (EOFError, zlib.error)):
            raise error
        self._tally.bad_lines.add(self._number, self._line.rstrip("\r\n"))
        self._line, self._again = "", True

    def close(self) -> None:
        """Leave the file to whom it belongs."""
