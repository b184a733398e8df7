"""Log files as a source: merged by time."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import Final

from tickrig.host.canmon.output.failure import SourceFailed
from tickrig.host.canmon.sources.source_word import FileWord
from tickrig.host.monitor.frames.candump_filter import flagged_id
from tickrig.host.monitor.frames.heard import Heard
from tickrig.host.monitor.logs.reading.log_reader import LogError, read_log

BATCH: Final = 1_024
"""Frames of one poll."""


class FileSource:
    """One or more log files.

    Raises:
        SourceFailed: a file cannot be read.
    """

    live = False

    def __init__(self, files: Sequence[FileWord]) -> None:
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

    def poll(self, timeout_us: int, /) -> list[Heard]:
        """Return the next frames; it never waits."""
        batch: list[Heard] = []
        try:
            batch.extend(islice(self._frames, BATCH))
        except (OSError, LogError) as error:
            self._failed = str(error)
        self._ended = len(batch) < BATCH
        return batch

    def words(self) -> list[str]:
        """Say what was no frame or got lost."""
        named = zip(self._names, self._readers, strict=True)
        return [word for name, reader in named for word in reader.tally.words(name)]

    def losses(self) -> list[str]:
        """Say what got lost or could not be taken."""
        named = zip(self._names, self._readers, strict=True)
        return [word for name, reader in named for word in reader.tally.losses(name)]

    def close(self) -> None:
        """Read no more."""
        self._ended = True
        self._frames = iter(())


def _check_readable(file: FileWord) -> None:
    try:
        file.path.open("rb").close()
    except OSError as error:
        raise SourceFailed(f"{file.path}: {error.strerror}") from error


def _chosen(file: FileWord, frames: Iterable[Heard]) -> Iterator[Heard]:
    chosen = file.chosen
    if chosen is None:
        return iter(frames)
    return (heard for heard in frames if chosen.passes(flagged_id(heard)))


def _merged(streams: Sequence[Iterator[Heard]]) -> Iterator[Heard]:
    return heapq.merge(*streams, key=lambda heard: heard.at_us)
