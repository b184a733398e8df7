"""A log file as the frames that are in it."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Final, Protocol, cast

from tickrig.host.monitor.frames.record import Record
from tickrig.host.monitor.logs.log_file import LogError, LogFormat, log_format, open_log
from tickrig.host.monitor.logs.log_lines import LogLines
from tickrig.host.monitor.logs.tally import Tally

BLOCK_BYTES: Final = 1 << 13
"""So few frames at once that the garbage collector seldom meets them."""

CAN_LOG: Final = "tickrig.host.monitor.logs.can_log"
"""python-can is slow to import: this module is when a log needs it."""

READERS: Final = {
    LogFormat.CANDUMP: (__name__, "TextLogReader"),
    LogFormat.JSONL: (__name__, "TextLogReader"),
    LogFormat.CSV: (__name__, "TextLogReader"),
    LogFormat.ASC: (CAN_LOG, "CanLogReader"),
    LogFormat.BLF: (CAN_LOG, "CanLogReader"),
    LogFormat.TRC: (CAN_LOG, "CanLogReader"),
    LogFormat.MF4: (CAN_LOG, "CanLogReader"),
}
"""Module and class of the reader of each format."""


class LogReader(Protocol):
    """An iterable of frames; it reads while it is iterated, from the beginning each time.

    Attributes:
        tally: what was no frame, so far.

    Raises:
        OSError: the file cannot be read, while it is iterated.
        LogError: it is not what its name says, likewise.
    """

    tally: Tally

    def __iter__(self) -> Iterator[Record]: ...


def read_log(path: Path) -> LogReader:
    """Return a reader of a log file; nothing is opened yet.

    Raises:
        LogFormatError: the file's name tells no format.
    """
    kind = log_format(path)
    module, name = READERS[kind]
    return cast("LogReader", getattr(import_module(module), name)(path, kind))


class TextLogReader:
    """A reader of a log in text."""

    def __init__(self, path: Path, kind: LogFormat) -> None:
        self._path, self.tally = path, Tally()

    def __iter__(self) -> Iterator[Record]:
        """Read the file."""
        lines = LogLines()
        self.tally = lines.tally
        try:
            with open_log(self._path) as file:
                while data := file.read(BLOCK_BYTES):
                    yield from lines.push(data)
        except (EOFError, zlib.error) as error:
            raise LogError(f"{self._path}: {error}") from error
        yield from lines.finish()
