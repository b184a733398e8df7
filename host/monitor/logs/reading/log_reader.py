"""A log file as the frames that are in it."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Final, Protocol, cast

from tickrig.host.monitor.frames.record import Record
from tickrig.host.monitor.logs.log_file import COMPRESSED, TEXT, log_format
from tickrig.host.monitor.logs.reading.log_lines import LogLines
from tickrig.host.monitor.logs.tally import BadLines, Tally

BLOCK_BYTES: Final = 1 << 13
"""So few frames at once that the garbage collector seldom meets them."""


class LogError(ValueError):
    """A file that is no log, or ends in the middle."""


class LogReader(Protocol):
    """An iterable of frames; it reads while it is iterated, from the beginning each time.

    Attributes:
        tally: what was no frame, so far.

    Raises:
        OSError: the file cannot be read, while it is iterated.
        LogError: it is not what its name says, likewise.
    """

    tally: Tally

    @property
    def bad_lines(self) -> BadLines:
        """Lines that are none of the log, so far."""
        ...

    def __iter__(self) -> Iterator[Record]: ...


def read_log(path: Path) -> LogReader:
    """Return a reader of a log file; nothing is opened yet.

    Raises:
        LogFormatError: the file's name tells no format.
    """
    kind = log_format(path)
    if kind in TEXT:
        return TextLogReader(path)
    from tickrig.host.monitor.logs.reading.can_log import CanLogReader  # noqa: PLC0415 - python-can is slow

    return CanLogReader(path, kind)


def open_log(path: Path) -> BinaryIO:
    """Open a file for reading, through gzip where its name says so."""
    if path.suffix.lower() != COMPRESSED:
        return path.open("rb")
    import gzip  # noqa: PLC0415 - seldom wanted

    return cast("BinaryIO", gzip.open(path, "rb"))  # it reads like one


class TextLogReader:
    """A reader of a log in text."""

    def __init__(self, path: Path) -> None:
        self._path, self.tally = path, Tally()

    @property
    def bad_lines(self) -> BadLines:
        """Lines that are none of the log, so far."""
        return self.tally.bad_lines

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
