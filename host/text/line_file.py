"""A recording on its way to a file, line by line."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from tickrig.host.text.log import log_of

_logger = log_of(__name__)

BINARY: Final[int] = getattr(os, "O_BINARY", 0)
"""Windows would write CR LF."""


class LineFile:
    """A file of lines; what is written is there at once, so a kill loses nothing.

    Where writing fails the recording ends with one warning, and the run goes on.

    Args:
        path: the file; one that exists is replaced.
        first: its first line.
        running: what goes on without it, for the warning.

    Attributes:
        error: why the recording ended early, empty while all is well.

    Raises:
        OSError: the file cannot be opened.
    """

    def __init__(self, path: Path, first: str, running: str = "the emulator") -> None:
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | BINARY, 0o666)
        self._path, self._running = path, running
        self.error = ""
        self.write([first])

    def write(self, lines: Sequence[str]) -> None:
        """Append lines, without LF."""
        if self._fd < 0 or not lines:
            return
        data = "".join(f"{line}\n" for line in lines).encode("ascii")
        try:
            while data:
                data = data[os.write(self._fd, data) :]
        except OSError as error:
            self.error = f"{self._path}: {error.strerror}"
            _logger.warning("recording ended: %s; %s goes on", self.error, self._running)
            self._close()

    def close(self, last: str) -> None:
        """Write the last line and close the file; closing twice is no error."""
        self.write([last])
        self._close()

    def _close(self) -> None:
        if self._fd >= 0:
            os.close(self._fd)
        self._fd = -1
