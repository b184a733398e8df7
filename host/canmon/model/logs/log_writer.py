"""Writers of frames into a log file."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Final, Protocol

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs import log_file, notation
from tickrig.wire.can import CanFrame, ErrorFrame

_BLOCK_LINES: Final = 256


MARKS: Final = "marks of gaps and triggers left out"


class LogWriter(Protocol):
    """A log file that is being written."""

    def write(self, record: Record, /) -> None:
        """Add a frame."""

    def mark(self, mark: log_file.Mark, /) -> None:
        """Add an item other than a frame, if the format can hold it."""

    def flush(self) -> None:
        """Pass all written items to the operating system.

        Other programs can then read these items, even if the log is never closed. If the log is
        compressed block by block (function `in_blocks`), each call makes the file larger, so call
        the method rarely.
        """

    def close(self) -> None:
        """End the log. You may close a log twice."""

    def messages(self) -> list[str]:
        """Report the items that the format could not hold, one per line."""


class TextBlock(Protocol):
    """A block of many frames that a log writer can write as text at once.

    Columns of frames, in `column_text`, implement this protocol. The time may decrease from one
    frame of the block to the next.

    Attributes:
        first_us: time of the frame at the start of the block.
        last_us: time of the frame at the end of the block.
        earliest_us: least time of all frames of the block.
        latest_us: greatest time of all frames of the block.
        errors: whether the block contains error frames.
    """

    first_us: int
    last_us: int
    earliest_us: int
    latest_us: int
    errors: bool

    def __len__(self) -> int:
        """Return the number of frames."""

    def log_lines(self) -> str:
        """Return the frames as `log_line` writes them, each line with its end."""

    def asc_lines(self, begin_us: int, number: Callable[[str], int], /) -> str:
        """Return the frames as `AscWriter` writes them.

        `number` returns numbers of buses, from 0.
        """


def in_blocks(path: Path) -> bool:
    """Return whether a log is compressed block by block."""
    return (
        path.suffix.lower() == log_file.COMPRESSED
        or log_file.log_format(path) is log_file.LogFormat.BLF
    )


def write_log(path: Path) -> LogWriter:
    """Create a log file, and return the writer for the format that its name indicates.

    An existing file is replaced.

    Raises:
        LogFormatError: the name of the file indicates no format.
        OSError: the file cannot be written.
        LogError: the format needs a library that is not installed.
    """
    kind = log_file.log_format(path)
    writer: LogWriter = log_file.writer_of(kind)(path, kind)
    return writer


def log_line(record: Record) -> str:
    """Return the line that `candump -L` writes for a frame.

    The line of a sent frame ends in T, as with `candump -L -x`.
    """
    at_us, channel, frame, sent = record
    end = " T" if sent else ""
    return f"({at_us // 1_000_000:010d}.{at_us % 1_000_000:06d}) {channel} {frame}{end}"


_LINES: Final = {
    log_file.LogFormat.CANDUMP: log_line,
    log_file.LogFormat.JSONL: notation.json_line,
    log_file.LogFormat.CSV: notation.csv_row,
}


def comment(mark: log_file.Mark) -> str:
    """Return a mark as a comment line, which programs that read candump's logs skip."""
    return f"# {mark.text}"


_MARKS: Final = {log_file.LogFormat.CANDUMP: comment, log_file.LogFormat.JSONL: log_file.Mark.json}


class TextLogWriter:
    """Writer of a text log in the format of candump, JSON or CSV."""

    def __init__(self, path: Path, kind: log_file.LogFormat) -> None:
        self._file, self._lines = log_file.open_log(path, "wb"), list[str]()
        self._kind = kind

    def write(self, record: Record, /) -> None:
        """Add a line."""
        self._lines.append(self._row(record))
        if len(self._lines) >= _BLOCK_LINES:
            self._give()

    def write_block(self, block: TextBlock, /) -> bool:
        """Write many frames at once.

        The result is False if the format cannot do this, so that the caller must write the frames
        one by one.
        """
        if self._kind is not log_file.LogFormat.CANDUMP:
            return False
        self._give()
        self._file.write(block.log_lines().encode())
        return True

    def mark(self, mark: log_file.Mark, /) -> None:
        """Add a comment, or an event."""
        self._lines.append(_MARKS[self._kind](mark))

    def flush(self) -> None:
        """Pass all items to the operating system."""
        self._give()
        self._file.flush()

    def close(self) -> None:
        """End the log."""
        if not self._file.closed:
            with self._file:
                self._give()

    def messages(self) -> list[str]:
        """Return no messages, because these formats hold all items."""
        return []

    def _row(self, record: Record) -> str:
        return _LINES[self._kind](record)

    def _give(self) -> None:
        self._file.write("".join(f"{line}\n" for line in self._lines).encode())
        self._lines.clear()


class CsvLogWriter(TextLogWriter):
    """Writer of a CSV log: a header, and a row for each frame. The rows do not name the bus."""

    def __init__(self, path: Path, kind: log_file.LogFormat) -> None:
        super().__init__(path, kind)
        self._name, self._channels, self._marks = path.name, dict[str, None](), 0
        self._lines.append(notation.LOG_HEADER)

    def write(self, record: Record, /) -> None:
        """Add a row."""
        self._channels[record.channel] = None
        super().write(record)

    def mark(self, mark: log_file.Mark, /) -> None:
        """Count a mark, because readers of python-can read each row as a frame."""
        self._marks += 1

    def messages(self) -> list[str]:
        """Report which buses were merged, and which items were left out."""
        said = [f"{self._name}: {self._marks} {MARKS}"] if self._marks else []
        if len(self._channels) > 1:
            buses = ", ".join(self._channels)
            said.append(f"{self._name}: csv does not tell buses apart: {buses}")
        return said


_NUMBERED: Final = re.compile(r"can([0-9]{1,3})")


class BusNumbers:
    """Numbers of buses for log formats that store no names.

    `can3` is 3, other names get free numbers.
    """

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}

    def number(self, channel: str) -> int:
        """Return the number of a bus."""
        if channel not in self._numbers:
            match = _NUMBERED.fullmatch(channel)
            number = int(match[1]) if match else 0
            while number in self._numbers.values():
                number += 1
            self._numbers[channel] = number
        return self._numbers[channel]

    def messages(self, name: str) -> list[str]:
        """Report the number of each bus, unless its name is `can` and this number."""
        return [
            f"{name}: {channel} became can{number}"
            for channel, number in self._numbers.items()
            if channel != f"can{number}"
        ]


_GVRET_HEADER: Final = "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8"
"""Header of SavvyCAN's own logs. Older logs have no `Dir`."""


class GvretLogWriter(TextLogWriter):
    """Writer of a GVRET log, the CSV format of SavvyCAN.

    The format holds only data frames with at most 8 bytes, and has numbers in place of bus names.
    """

    def __init__(self, path: Path, kind: log_file.LogFormat) -> None:
        super().__init__(path, kind)
        self._name, self._numbers, self._left_out = path.name, BusNumbers(), Counter[str]()
        self._lines.append(_GVRET_HEADER)

    def write(self, record: Record, /) -> None:
        """Add a row, or count an item that such a log cannot hold."""
        frame = record.frame
        if isinstance(frame, CanFrame) and not frame.remote:
            super().write(record)
        else:
            is_error = isinstance(frame, ErrorFrame)
            kind = "remote" if isinstance(frame, CanFrame) else "error" if is_error else "CAN FD"
            self._left_out[f"{kind} frames left out"] += 1

    def mark(self, mark: log_file.Mark, /) -> None:
        """Count a mark."""
        self._left_out[MARKS] += 1

    def messages(self) -> list[str]:
        """Report which items were left out, and the number of each bus."""
        said = [f"{self._name}: {count} {what}" for what, count in self._left_out.items()]
        return said + self._numbers.messages(self._name)

    def _row(self, record: Record) -> str:
        return notation.gvret_row(record, self._numbers.number(record.channel))
