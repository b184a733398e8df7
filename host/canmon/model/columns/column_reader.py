"""A log file as columns, many lines at a time.

A candump log is read in blocks. Its usual lines are taken apart all at once
(`CandumpBlock`); every other line goes through the parser of single lines, so
that the result is the same, frame for frame. Other formats are read frame by frame.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Final

from tickrig.host.canmon.model.columns.candump_block import CandumpBlock
from tickrig.host.canmon.model.columns.columns import ChannelNames, Columns, Rows
from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.logs.log_file import (
    LogError,
    LogFormat,
    log_format,
    open_log,
    read_blocks,
)
from tickrig.host.canmon.model.logs.log_reader import WholeLines, parse_log_line, read_log
from tickrig.host.canmon.model.logs.screen_line import HEAD, ScreenClock
from tickrig.host.canmon.model.logs.tally import Tally

BLOCK_BYTES: Final = 1 << 20
"""Some 23 000 lines: what is computed of them stays in the cache, and numpy's calls cost little."""

BATCH: Final = 1 << 13
"""Frames of a block, where they are read one by one."""


def read_columns(path: Path) -> ColumnReader:
    """Return a reader of a log file; nothing is opened yet.

    Raises:
        LogFormatError: the file's name tells no format.
    """
    return ColumnReader(path, log_format(path))


class ColumnReader:
    """An iterable of blocks of a log; it reads while it is iterated, once.

    It holds one block, whatever the size of the file.

    Attributes:
        tally: what was no frame, so far.

    Raises:
        OSError: the file cannot be read, while it is iterated.
        LogError: it is not what its name says, or has more than 256 buses, likewise.
        NoColumnsError: there is a frame of CAN FD, likewise.
    """

    def __init__(self, path: Path, kind: LogFormat) -> None:
        self._path, self._kind, self.tally = path, kind, Tally()
        self._channels = ChannelNames()

    def __iter__(self) -> Iterator[Columns]:
        """Read the file."""
        candump = self._kind is LogFormat.CANDUMP
        for rows in self._of_lines() if candump else self._of_frames():
            yield rows.columns(self._channels)

    def _of_frames(self) -> Iterator[Rows]:
        reader = read_log(self._path)
        frames, failed, more = iter(reader), None, True
        while more:
            batch: list[Record] = []
            try:
                batch.extend(islice(frames, BATCH))
            except (LogError, OSError) as error:  # all that was read before it counts
                failed = error
            self.tally, more = reader.tally, len(batch) == BATCH and failed is None
            if batch:
                yield Rows.of(batch, self._channels)
        if failed is not None:
            raise failed

    def _of_lines(self) -> Iterator[Rows]:
        whole, number, clock = WholeLines(), 0, None
        with open_log(self._path) as file:
            for data in read_blocks(file, self._path, BLOCK_BYTES):
                if lines := whole.push(data):
                    clock = clock or _clock_of(lines)
                    rows = self._take_apart(lines, number, clock)
                    number += len(rows.known)
                    yield rows
        if rest := whole.finish():
            yield self._take_apart(rest + b"\n", number, clock or _clock_of(rest))

    def _take_apart(self, text: bytes, number: int, clock: ScreenClock) -> Rows:
        """Return a row for each line; `number` lines are before them."""
        block = CandumpBlock(text)
        rows = Rows(len(block.starts))
        block.take(rows, self._channels)
        for row in (~rows.known).nonzero()[0].tolist():
            record = parse_log_line(block.line(row), number + row + 1, self.tally, clock)
            if record is not None:
                rows.put(row, record, self._channels.place(record.channel))
        return rows


def _clock_of(lines: bytes) -> ScreenClock:
    return ScreenClock.of(lines[:HEAD].decode("latin-1"))
