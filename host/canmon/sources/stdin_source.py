"""Standard input as a source: lines of candump or of JSON, as they come."""

from __future__ import annotations

import os
import select
from typing import Final

from tickrig.host.monitor.frames.heard import Heard
from tickrig.host.monitor.logs.reading.log_lines import LogLines

STDIN: Final = 0
READ_BYTES: Final = 1 << 16


class StdinSource:
    """A pipe, a terminal or a file that somebody feeds."""

    live = True

    def __init__(self, descriptor: int = STDIN) -> None:
        self._descriptor, self._lines = descriptor, LogLines()
        self._ended, self._failed = False, ""

    @property
    def ended(self) -> bool:
        """Say that its writer has closed it."""
        return self._ended

    @property
    def lost(self) -> int:
        """Frames that its writer says it lost."""
        return self._lines.tally.lost

    @property
    def unread(self) -> int:
        """Lines and frames that could not be taken."""
        return self._lines.tally.unread

    @property
    def failed(self) -> str:
        """Why reading ended early."""
        return self._failed

    def poll(self, timeout_us: int, /) -> list[Heard]:
        """Wait for bytes; return the frames of the lines that are whole."""
        if self._ended or not select.select([self._descriptor], [], [], timeout_us / 1e6)[0]:
            return []
        try:
            data = os.read(self._descriptor, READ_BYTES)
        except OSError as error:
            data, self._failed = b"", f"standard input: {error.strerror}"
        if data:
            return self._lines.push(data)
        self._ended = True
        return self._lines.finish()

    def words(self) -> list[str]:
        """Say what was no frame or got lost."""
        return self._lines.tally.words("standard input")

    def losses(self) -> list[str]:
        """Say what got lost or could not be taken."""
        return self._lines.tally.losses("standard input")

    def close(self) -> None:
        """Read no more; the descriptor is not ours."""
        self._ended = True
