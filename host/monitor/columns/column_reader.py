"""A log file as columns, many lines at a time.

A candump log is read in blocks. Its usual lines are taken apart all at once
(`candump_block`); every other line goes through the parser of single lines, so
that the result is the same, frame for frame. Other formats are read frame by frame.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import BinaryIO, Final

from tickrig.host.monitor.columns.candump_block import CandumpBlock
from tickrig.host.monitor.columns.columns import ChannelNames, Columns, Rows, joined
from tickrig.host.monitor.logs.log_file import LogError, LogFormat, log_format, open_log
from tickrig.host.monitor.logs.log_lines import WholeLines, parse_log_line
from tickrig.host.monitor.logs.log_reader import LogReader, read_log
from tickrig.host.monitor.logs.screen_line import HEAD, ScreenClock
from tickrig.host.monitor.logs.tally import Tally

BLOCK_BYTES: Final = 1 << 20
BATCH: Final = 1 << 16


def read_columns(path: Path) -> Columns:
    """Read a whole log.

    Raises:
        LogFormatError: the file's name tells no format.
        OSError: the file cannot be read.
        LogError: it is not what its name says, or has more than 256 buses.
    """
    channels = ChannelNames()
    if log_format(path) is not LogFormat.CANDUMP:
        reader = read_log(path)
        return joined(_batches(reader, channels), channels, reader.tally)
    tally = Tally()
    with open_log(path) as file:
        return joined(_blocks(file, path, channels, tally), channels, tally)


def _batches(reader: LogReader, channels: ChannelNames) -> Iterator[Rows]:
    frames = iter(reader)
    while batch := list(islice(frames, BATCH)):
        yield Rows.of(batch, channels)


def _blocks(file: BinaryIO, path: Path, channels: ChannelNames, tally: Tally) -> Iterator[Rows]:
    number, clock = 0, None
    for text in _whole_lines(file, path):
        clock = clock or ScreenClock.of(text[:HEAD].decode("latin-1"))
        rows = _take_apart(text, number, channels, tally, clock)
        number += len(rows.known)
        yield rows


def _whole_lines(file: BinaryIO, path: Path) -> Iterator[bytes]:
    """Cut a file into blocks that end with LF."""
    whole = WholeLines()
    try:
        while data := file.read(BLOCK_BYTES):
            if lines := whole.push(data):
                yield lines
    except (EOFError, zlib.error) as error:
        raise LogError(f"{path}: {error}") from error
    if rest := whole.finish():
        yield rest + b"\n"


def _take_apart(
    text: bytes, number: int, channels: ChannelNames, tally: Tally, clock: ScreenClock
) -> Rows:
    """Return a row for each line; `number` lines are before them."""
    block = CandumpBlock(text)
    rows = Rows(len(block.starts))
    block.take(rows, channels)
    for row in (~rows.known).nonzero()[0].tolist():
        record = parse_log_line(block.line(row), number + row + 1, tally, clock)
        if record is None:
            continue
        rows.put(row, record, channels.place(record.channel))
    return rows
