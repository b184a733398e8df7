"""Log files, merged by time, and standard input as sources."""

from __future__ import annotations

import heapq
import os
import select
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import Final

from tickrig.host.canmon.errors import SourceFailed
from tickrig.host.canmon.sources.source_spec import FileSpec
from tickrig.host.monitor.frames.candump_filter import flagged_id
from tickrig.host.monitor.frames.record import Record
from tickrig.host.monitor.logs.log_file import LogError
from tickrig.host.monitor.logs.log_lines import LogLines
from tickrig.host.monitor.logs.log_reader import read_log

BATCH: Final = 1_024
"""Frames of one poll."""


class FileSource:
    """One or more log files.

    Raises:
        SourceFailed: a file cannot be read.
    """

    live = False

    def __init__(self, files: Sequence[FileSpec]) -> None:
        self._names = [str(file.path) for file in files]
        self._readers = [read_log(file.path) for file in files]
        for file in files:
            _check_readable(file)
        streams = [_chosen(file, reader) for file, reader in zip(files, self._readers, strict=True)]
        self._frames = streams[0] if len(streams) == 1 else _merged(streams)
        self._ended, self._failed = False, ""

    @property
    def ended(self) -> bool:
        """Say that all was read."""
        return self._ended

    @property
    def lost(self) -> int:
        """Frames that the recorders say they lost."""
        return sum(reader.tally.lost for reader in self._readers)

    @property
    def unread(self) -> int:
        """Lines and frames that could not be taken."""
        return sum(reader.tally.unread for reader in self._readers)

    @property
    def failed(self) -> str:
        """Why reading ended early."""
        return self._failed

    def poll(self, timeout_us: int, /) -> list[Record]:
        """Return the next frames; it never waits."""
        batch: list[Record] = []
        try:
            batch.extend(islice(self._frames, BATCH))
        except (OSError, LogError) as error:
            self._failed = str(error)
        self._ended = len(batch) < BATCH
        return batch

    def messages(self) -> list[str]:
        """Say what was no frame or got lost."""
        named = zip(self._names, self._readers, strict=True)
        return [word for name, reader in named for word in reader.tally.messages(name)]

    def losses(self) -> list[str]:
        """Say what got lost or could not be taken."""
        named = zip(self._names, self._readers, strict=True)
        return [word for name, reader in named for word in reader.tally.losses(name)]

    def close(self) -> None:
        """Read no more."""
        self._ended = True
        self._frames = iter(())


def _check_readable(file: FileSpec) -> None:
    try:
        file.path.open("rb").close()
    except OSError as error:
        raise SourceFailed(f"{file.path}: {error.strerror}") from error


def _chosen(file: FileSpec, frames: Iterable[Record]) -> Iterator[Record]:
    chosen = file.chosen
    if chosen is None:
        return iter(frames)
    return (record for record in frames if chosen.passes(flagged_id(record)))


def _merged(streams: Sequence[Iterator[Record]]) -> Iterator[Record]:
    return heapq.merge(*streams, key=lambda record: record.at_us)


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

    def poll(self, timeout_us: int, /) -> list[Record]:
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

    def messages(self) -> list[str]:
        """Say what was no frame or got lost."""
        return self._lines.tally.messages("standard input")

    def losses(self) -> list[str]:
        """Say what got lost or could not be taken."""
        return self._lines.tally.losses("standard input")

    def close(self) -> None:
        """Read no more; the descriptor is not ours."""
        self._ended = True
