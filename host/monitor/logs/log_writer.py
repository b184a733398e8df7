"""Frames into a log file."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Final, Protocol, cast

from tickrig.host.monitor.frames.record import Record
from tickrig.host.monitor.logs.log_file import COMPRESSED, LogFormat, log_format, open_log
from tickrig.host.monitor.logs.mark import Mark
from tickrig.host.monitor.logs.notation import LOG_HEADER, csv_row, json_line

BLOCK_LINES: Final = 256


CAN_LOG_WRITER: Final = "tickrig.host.monitor.logs.can_log_writer"
"""python-can is slow to import: this module is when a log needs it."""

MARKS: Final = "marks of gaps and triggers left out"

CAPTURE_WRITER: Final = "tickrig.host.monitor.logs.pcap.pcapng_writer"

WRITERS: Final = {
    LogFormat.CANDUMP: (__name__, "TextLogWriter"),
    LogFormat.JSONL: (__name__, "TextLogWriter"),
    LogFormat.CSV: (__name__, "CsvLogWriter"),
    LogFormat.ASC: (CAN_LOG_WRITER, "CanLogWriter"),
    LogFormat.BLF: (CAN_LOG_WRITER, "CanLogWriter"),
    LogFormat.TRC: (CAN_LOG_WRITER, "CanLogWriter"),
    LogFormat.MF4: (CAN_LOG_WRITER, "CanLogWriter"),
    LogFormat.TRACE: ("tickrig.host.monitor.logs.trace_log", "TraceLogWriter"),
    LogFormat.PCAPNG: (CAPTURE_WRITER, "PcapngWriter"),
    LogFormat.PCAP: (CAPTURE_WRITER, "PcapngWriter"),
}
"""Module and class of the writer of each format."""


class LogWriter(Protocol):
    """A log file that is written."""

    def write(self, record: Record, /) -> None:
        """Add a frame."""
        ...

    def mark(self, mark: Mark, /) -> None:
        """Add what is no frame, where the format can hold it."""
        ...

    def flush(self) -> None:
        """Give all that was added to the operating system: it is readable if nothing follows.

        Where `in_blocks` says so that makes the file larger: do it seldom.
        """
        ...

    def close(self) -> None:
        """End the log; closing twice is no error."""
        ...

    def messages(self) -> list[str]:
        """Say what the format could not hold, one line each."""
        ...


def in_blocks(path: Path) -> bool:
    """Say whether a log is compressed, block by block."""
    return path.suffix.lower() == COMPRESSED or log_format(path) is LogFormat.BLF


def write_log(path: Path) -> LogWriter:
    """Begin a log; a file that exists is replaced.

    Raises:
        LogFormatError: the file's name tells no format.
        OSError: it cannot be written.
        LogError: its format needs a library that is not there.
    """
    kind = log_format(path)
    module, name = WRITERS[kind]
    return cast("LogWriter", getattr(import_module(module), name)(path, kind))


def log_line(record: Record) -> str:
    """Write a frame as `candump -L` does; what we sent ends in T, as `candump -L -x` has it."""
    at_us, channel, frame, sent = record
    end = " T" if sent else ""
    return f"({at_us // 1_000_000:010d}.{at_us % 1_000_000:06d}) {channel} {frame}{end}"


_LINES: Final = {
    LogFormat.CANDUMP: log_line,
    LogFormat.JSONL: json_line,
    LogFormat.CSV: csv_row,
}


def comment(mark: Mark) -> str:
    """Write a mark as programs pass it over that read candump's logs."""
    return f"# {mark.text}"


_MARKS: Final = {LogFormat.CANDUMP: comment, LogFormat.JSONL: Mark.json}


class TextLogWriter:
    """A log in lines: candump's, JSON or CSV."""

    def __init__(self, path: Path, kind: LogFormat) -> None:
        self._file, self._lines = open_log(path, "wb"), list[str]()
        self._text, self._kind = _LINES[kind], kind

    def write(self, record: Record, /) -> None:
        """Add a line."""
        self._lines.append(self._text(record))
        if len(self._lines) >= BLOCK_LINES:
            self._give()

    def mark(self, mark: Mark, /) -> None:
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

    def _give(self) -> None:
        self._file.write("".join(f"{line}\n" for line in self._lines).encode())
        self._lines.clear()


class CsvLogWriter(TextLogWriter):
    """Rows below a header; they do not name their bus."""

    def __init__(self, path: Path, kind: LogFormat) -> None:
        super().__init__(path, kind)
        self._name, self._channels, self._marks = path.name, dict[str, None](), 0
        self._lines.append(LOG_HEADER)

    def write(self, record: Record, /) -> None:
        """Add a row."""
        self._channels[record.channel] = None
        super().write(record)

    def mark(self, mark: Mark, /) -> None:
        """Count it: readers of python-can take each row for a frame."""
        self._marks += 1

    def messages(self) -> list[str]:
        """Say which buses became one, and what was left out."""
        said = [f"{self._name}: {self._marks} {MARKS}"] if self._marks else []
        if len(self._channels) > 1:
            buses = ", ".join(self._channels)
            said.append(f"{self._name}: csv does not tell buses apart: {buses}")
        return said
