"""Record a CAN bus in a file that the can-utils read."""

from __future__ import annotations

from pathlib import Path

from tickrig.host.text.log import log_of
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorFrame
from tickrig.wire.candump import LogLine

_logger = log_of(__name__)


class CandumpFile:
    """A log on its way to a file; each line is written at once, so a kill loses nothing.

    Where writing fails the recording ends with one warning, and the run goes
    on. Its `hear` is an observer of a `CanWire`.

    Args:
        path: the file; one that exists is replaced.
        channel: what the bus is called in it.

    Attributes:
        error: why the recording ended early, empty while all is well.

    Raises:
        ValueError: a channel with blanks, or none.
        OSError: the file cannot be opened.
    """

    def __init__(self, path: Path, channel: str = "vcan0") -> None:
        if not channel or channel.split() != [channel]:
            raise ValueError(f"channel {channel!r} is not a name without blanks")
        self._path, self._channel, self.error = path, channel, ""
        self._file = path.open("w", buffering=1, encoding="ascii")

    def hear(self, at_us: int, received: CanFrame | ErrorFrame) -> None:
        """Write what was on the bus."""
        if self.error:
            return
        try:
            self._file.write(f"{LogLine(at_us, self._channel, received)}\n")
        except OSError as error:
            self.error = f"{self._path}: {error.strerror}"
            _logger.warning("recording ended: %s; the emulator goes on", self.error)

    def close(self, now_us: int = 0) -> None:
        """Close the file, at a time that it has no line for; closing twice is no error."""
        try:
            self._file.close()
        except OSError as error:
            self.error = self.error or f"{self._path}: {error.strerror}"
