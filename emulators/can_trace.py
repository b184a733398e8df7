"""What passes on a CAN bus, as a candump log."""

from __future__ import annotations

from pathlib import Path

from tickrig.emulators.duration import format_time
from tickrig.emulators.line_file import LineFile
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorFrame


def candump_line(at_us: int, channel: str, frame: CanFrame | ErrorFrame) -> str:
    """Return a line of `candump -L`.

    >>> candump_line(1_500_250, "can0", CanFrame(0x705, bytes([0x7F])))
    '(1.500250) can0 705#7F'
    """
    return f"({format_time(at_us)}) {channel} {frame}"


class CanTrace:
    """A candump log on its way to a file; an observer of a `CanWire`.

    Args:
        path: the file; one that exists is replaced.
        channel: what the bus is called in it.

    Raises:
        OSError: the file cannot be opened.
    """

    def __init__(self, path: Path, channel: str) -> None:
        self._file, self._channel = LineFile(path), channel

    @property
    def error(self) -> str:
        """Why the recording ended early, empty while all is well."""
        return self._file.error

    def hear(self, at_us: int, frame: CanFrame | ErrorFrame) -> None:
        """Record what ended on the bus."""
        self._file.write([candump_line(at_us, self._channel, frame)])

    def close(self) -> None:
        """End the recording."""
        self._file.close()
