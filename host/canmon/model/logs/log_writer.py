"""Frames into a log file."""

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
    """A log file that is written."""

    def write(self, record: Record, /) -> None:
        """Add a frame."""

    def mark(self, mark: log_file.Mark, /) -> None:
        """Add an item other than a frame, if the format can hold it."""

    def flush(self) -> None:
        """Pass all added items to the operating system: they are readable if nothing follows.

        With `in_blocks` this makes the file larger: call it rarely.
        """

    def close(self) -> None:
        """End the log; closing twice is no error."""

    def messages(self) -> list[str]:
        """Report what the format could not hold, one line each."""


class TextBlock(Protocol):
    """Many frames that write themselves as lines at once; `column_text` implements it.

    Attributes:
        first_us: time of the first frame.
        last_us: time of the last frame.
        earliest_us: the least time.
        latest_us: the greatest time.
        errors: whether there are error frames.
    """

    first_us: int
    last_us: int
    earliest_us: int
    latest_us: int
    errors: bool

    def __len__(self) -> int:
        """Return how many frames there are."""

    def log_lines(self) -> str:
        """Write them as `log_line` does, each line with its end."""

    def asc_lines(self, begin_us: int, number: Callable[[str], int], /) -> str:
        """Write them as `AscWriter` does; it tells the numbers of buses, from 0."""


def in_blocks(path: Path) -> bool:
    """Return whether a log is compressed, block by block."""
    return (
        path.suffix.lower() == log_file.COMPRESSED
        or log_file.log_format(path) is log_file.LogFormat.BLF
    )


def write_log(path: Path) -> LogWriter:
    """Begin a log; a file that exists is replaced.

    Raises:
        LogFormatError: the file's name has no known format.
        OSError: it cannot be written.
        LogError: its format needs a library that is not installed.
    """
    kind = log_file.log_format(path)
    writer: LogWriter = log_file.writer_of(kind)(path, kind)
    return writer


def log_line(record: Record) -> str:
    """Write a frame as `candump -L` does; what we sent ends in T, as `candump -L -x` has it."""
    at_us, channel, frame, sent = record
    end = " T" if sent else ""
    return f"({at_us // 1_000_000:010d}.{at_us % 1_000_000:06d}) {channel} {frame}{end}"


_LINES: Final = {
    log_file.LogFormat.CANDUMP: log_line,
    log_file.LogFormat.JSONL: notation.json_line,
    log_file.LogFormat.CSV: notation.csv_row,
}


def comment(mark: log_file.Mark) -> str:
    """Write a mark as programs pass it over that read candump's logs."""
    return f"# {mark.text}"


_MARKS: Final = {log_file.LogFormat.CANDUMP: comment, log_file.LogFormat.JSONL: log_file.Mark.json}


class TextLogWriter:
    """A log in lines: candump's, JSON or CSV."""

    def __init__(self, path: Path, kind: log_file.LogFormat) -> None:
        self._file, self._lines = log_file.open_log(path, "wb"), list[str]()
        self._kind = kind

    def write(self, record: Record, /) -> None:
        """Add a line."""
        self._lines.append(self._row(record))
        if len(self._lines) >= _BLOCK_LINES:
            self._give()

    def write_block(self, block: TextBlock, /) -> bool:
        """Add many frames at once; False where they are to be added one by one."""
        if self._kind is not log_file.LogFormat.CANDUMP:
            return False
        self._give()
        self._file.write(block.log_lines().encode())
        return True

    def mark(self, mark: log_file.Mark, /) -> None:
        """Add a comment, or an event."""
        self._lines.append(_MARKS[self._kind](mark))

    def flush(self) -> None:
        """Give what was added to the operating system."""
        self._give()
        self._file.flush()

    def close(self) -> None:
        """End the log."""
        if not self._file.closed:
            try:
                self._give()
            finally:
                self._file.close()

    def messages(self) -> list[str]:
        """Nothing: these formats hold all there is."""
        return []

    def _row(self, record: Record) -> str:
        return _LINES[self._kind](record)

    def _give(self) -> None:
        self._file.write("".join(f"{line}\n" for line in self._lines).encode())
        self._lines.clear()


class CsvLogWriter(TextLogWriter):
    """Rows below a header; they do not name their bus."""

    def __init__(self, path: Path, kind: log_file.LogFormat) -> None:
        super().__init__(path, kind)
        self._name, self._channels, self._marks = path.name, dict[str, None](), 0
        self._lines.append(notation.LOG_HEADER)

    def write(self, record: Record, /) -> None:
        """Add a row."""
        self._channels[record.channel] = None
        super().write(record)

    def mark(self, mark: log_file.Mark, /) -> None:
        """Count it: readers of python-can take each row for a frame."""
        self._marks += 1

    def messages(self) -> list[str]:
        """Report which buses became one, and what was left out."""
        said = [f"{self._name}: {self._marks} {MARKS}"] if self._marks else []
        if len(self._channels) > 1:
            buses = ", ".join(self._channels)
            said.append(f"{self._name}: csv does not tell buses apart: {buses}")
        return said


_NUMBERED: Final = re.compile(r"can([0-9]{1,3})")


class BusNumbers:
    """Numbers of buses in a log without names: `can3` is number 3, others take free numbers."""

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
        """Report which bus became which number, if its name does not show it."""
        return [
            f"{name}: {channel} became can{number}"
            for channel, number in self._numbers.items()
            if channel != f"can{number}"
        ]


_GVRET_HEADER: Final = "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8"
"""Of SavvyCAN's own logs; older ones have no `Dir`."""


class GvretLogWriter(TextLogWriter):
    """Rows as SavvyCAN reads them: data frames of at most 8 bytes, with numbers of buses."""

    def __init__(self, path: Path, kind: log_file.LogFormat) -> None:
        super().__init__(path, kind)
        self._name, self._numbers, self._left_out = path.name, BusNumbers(), Counter[str]()
        self._lines.append(_GVRET_HEADER)

    def write(self, record: Record, /) -> None:
        """Add a row, or count what such a log does not hold."""
        frame = record.frame
        if isinstance(frame, CanFrame) and not frame.remote:
            super().write(record)
        else:
            is_error = isinstance(frame, ErrorFrame)
            kind = "remote" if isinstance(frame, CanFrame) else "error" if is_error else "CAN FD"
            self._left_out[f"{kind} frames left out"] += 1

    def mark(self, mark: log_file.Mark, /) -> None:
        """Count it."""
        self._left_out[MARKS] += 1

    def messages(self) -> list[str]:
        """Report what was left out, and which bus has which number."""
        said = [f"{self._name}: {count} {what}" for what, count in self._left_out.items()]
        return said + self._numbers.messages(self._name)

    def _row(self, record: Record) -> str:
        return notation.gvret_row(record, self._numbers.number(record.channel))
