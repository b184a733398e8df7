"""Log files, merged by time, and standard input as sources."""

from __future__ import annotations

import heapq
import os
import select
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Final

from tickrig.host.canmon.errors import SourceFailed
from tickrig.host.canmon.sources.source import AnySource
from tickrig.host.canmon.sources.source_spec import FileSpec
from tickrig.host.monitor.frames.ident import flagged_id
from tickrig.host.monitor.frames.record import Record
from tickrig.host.monitor.logs.log_file import LogError
from tickrig.host.monitor.logs.log_reader import LogLines, read_log
from tickrig.host.monitor.logs.tally import Tally

BATCH: Final = 1_024
"""Frames of one poll."""


class FileSource(AnySource[Record]):
    """One or more log files.

    Raises:
        SourceFailed: a file cannot be read.
    """

    live = False

    def __init__(self, files: Sequence[FileSpec]) -> None:
        self._names = [str(file.path) for file in files]
        self._readers = [read_log(file.path) for file in files]
        for file in files:
            check_readable(file.path)
        streams = [_chosen(file, reader) for file, reader in zip(files, self._readers, strict=True)]
        self._frames = streams[0] if len(streams) == 1 else _merged(streams)

    def tallies(self) -> Iterable[tuple[str, Tally]]:
        """Return the tally of each file, with its name."""
        return [
            (name, reader.tally) for name, reader in zip(self._names, self._readers, strict=True)
        ]

    def poll(self, timeout_us: int, /) -> list[Record]:
        """Return the next frames; it never waits."""
        batch: list[Record] = []
        try:
            batch.extend(islice(self._frames, BATCH))
        except (OSError, LogError) as error:
            self.failed = str(error)
        self._ended = len(batch) < BATCH
        return batch

    def close(self) -> None:
        """Read no more."""
        super().close()
        self._frames = iter(())


def check_readable(path: Path) -> None:
    """Raise SourceFailed where a file cannot be read."""
    try:
        path.open("rb").close()
    except OSError as error:
        raise SourceFailed(f"{path}: {error.strerror}") from error


def _chosen(file: FileSpec, frames: Iterable[Record]) -> Iterator[Record]:
    chosen = file.chosen
    if chosen is None:
        return iter(frames)
    return (record for record in frames if chosen.passes(flagged_id(record)))


def _merged(streams: Sequence[Iterator[Record]]) -> Iterator[Record]:
    return heapq.merge(*streams, key=lambda record: record.at_us)


STDIN: Final = 0
READ_BYTES: Final = 1 << 16


class StdinSource(AnySource[Record]):
    """A pipe, a terminal or a file that somebody feeds."""

    live = True

    def __init__(self, descriptor: int = STDIN) -> None:
        self._descriptor, self._lines = descriptor, LogLines()

    def tallies(self) -> Iterable[tuple[str, Tally]]:
        """Return the tally of what came."""
        return [("standard input", self._lines.tally)]

    def poll(self, timeout_us: int, /) -> list[Record]:
        """Wait for bytes; return the frames of the lines that are whole."""
        if self._ended or not select.select([self._descriptor], [], [], timeout_us / 1e6)[0]:
            return []
        try:
            data = os.read(self._descriptor, READ_BYTES)
        except OSError as error:
            data, self.failed = b"", f"standard input: {error.strerror}"
        if data:
            return self._lines.push(data)
        self._ended = True
        return self._lines.finish()
