"""Frames in the traces of benches and of ports (docs/reference/bench/trace.md)."""

from __future__ import annotations

import re
import zlib
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs import log_file
from tickrig.host.canmon.model.logs.log_file import Mark as LogMark
from tickrig.host.text import bench_header
from tickrig.host.text.bench_record import BenchParser, BenchRecord
from tickrig.host.text.trace import Mark, TraceError
from tickrig.wire.can import CanFrame, ErrorFrame

_OTHER_BUSES = "frames of other buses"
_ERROR_FRAMES = "error frames"
_LOG_MARKS = "marks of gaps and triggers"
_FD_FRAMES = "CAN FD frames"

_WITHOUT_ERRORS = "a trace holds no error frames"

_MARKS = {True: Mark.TO_DEVICE, False: Mark.FROM_DEVICE}


class TraceLogWriter:
    """Writer of a trace file of the test bench, with the frames of one bus as the host sees them.

    Only the bus of the first frame is written. Frames of other buses are only counted. All times in
    the file count from the first frame.
    """

    def __init__(self, path: Path, kind: log_file.LogFormat) -> None:
        self._file, self._name = log_file.open_log(path, "wb"), path.name
        self._channel, self._began_us, self._latest_us = "", 0, 0
        self._left_out: Counter[str] = Counter()

    def write(self, record: Record, /) -> None:
        """Write a frame.

        If its time is before that of the previous frame, it gets that frame's time.
        """
        if not self._channel:
            self._begin(record)
        if record.channel != self._channel or not isinstance(record.frame, CanFrame):
            kind = _ERROR_FRAMES if isinstance(record.frame, ErrorFrame) else _FD_FRAMES
            self._left_out[_OTHER_BUSES if record.channel != self._channel else kind] += 1
            return
        self._latest_us = max(self._latest_us, record.at_us - self._began_us)
        mark = _MARKS[record.sent]
        self._put(BenchRecord(self._latest_us, _name(self._channel), mark, record.frame).encode())

    def mark(self, mark: LogMark, /) -> None:
        """Count a mark, because a trace holds only frames."""
        self._left_out[_LOG_MARKS] += 1

    def flush(self) -> None:
        """Pass all items to the operating system."""
        self._file.flush()

    def close(self) -> None:
        """End the trace."""
        if not self._file.closed:
            with self._file:
                if self._channel:
                    self._put(BenchRecord(self._latest_us, "", Mark.END).encode())

    def messages(self) -> list[str]:
        """Report the items that were left out."""
        return [
            f"{self._name}: a trace holds one bus, without errors; left out: {count} {what}"
            for what, count in self._left_out.items()
        ]

    def _begin(self, record: Record) -> None:
        self._channel, self._began_us = record.channel, record.at_us
        name = _name(record.channel)
        wires = {"bus": bench_header.WireEntry(bench_header.WireType.CAN)}
        self._put(
            bench_header.BenchHeader(
                {name: bench_header.DeviceEntry("bus")}, wires, place=bench_header.Place.PORT
            ).encode()
        )

    def _put(self, line: str) -> None:
        self._file.write(f"{line}\n".encode("ascii"))


def _name(channel: str) -> str:
    """Return the name of a bus in a form that a trace can hold."""
    return re.sub(r"[^\w./:-]|^\W", "_", channel, flags=re.ASCII)


class TraceLogReader:
    """Reader of the CAN frames in a trace file of the test bench.

    A trace that was recorded at the devices may contain a frame once for each device. The reader
    returns such a frame once. A frame of a device is returned when the device sent it. A frame of
    the host is returned when the first device received it.
    """

    def __init__(self, path: Path, kind: log_file.LogFormat) -> None:
        self._path, self.tally = path, log_file.LogTally()

    def __iter__(self) -> Iterator[Record]:
        """Read the file."""
        self.tally = log_file.LogTally(without_errors=_WITHOUT_ERRORS)
        try:
            with log_file.open_log(self._path) as file:
                header = bench_header.parse_bench_header(
                    file.readline().decode("ascii").rstrip("\n")
                )
                passed = _Passed(header)
                for record in BenchParser(header).parse(_whole_lines(file)):
                    if isinstance(record.traffic, CanFrame):
                        yield from passed.take(record, record.traffic)
                    elif record.traffic:
                        self.tally.pass_over(log_file.SERIAL_LINES)
        except (EOFError, zlib.error, TraceError) as error:
            raise log_file.LogError(f"{self._path}: {error}") from error
        except UnicodeDecodeError:
            raise log_file.LogError(f"{self._path}: it is not ASCII") from None

    def items(self) -> Iterator[Record]:
        """Read the file, which holds no marks."""
        return iter(self)


def _whole_lines(file: BinaryIO) -> Iterator[str]:
    """Return the lines. A last line without LF is from a writer that was killed."""
    for line in file:
        if line.endswith(b"\n"):
            yield line[:-1].decode("ascii")


class _Passed:
    """The traffic of a bus, reconstructed from the frames that its nodes sent and received."""

    def __init__(self, header: bench_header.BenchHeader) -> None:
        self._header = header
        self._at_us, self._of_host = 0, Counter[tuple[str, CanFrame]]()
        self._received: defaultdict[str, Counter[CanFrame]] = defaultdict(Counter)
        self._awaited: defaultdict[str, Counter[CanFrame]] = defaultdict(Counter)

    def take(self, record: BenchRecord, frame: CanFrame) -> Iterator[Record]:
        """Yield a frame, unless it was already yielded."""
        header, name = self._header, record.name
        wire = header.devices[name].wire
        if header.place is bench_header.Place.PORT:
            yield Record(record.at_us, name, frame, record.mark is Mark.TO_DEVICE)
        elif record.mark is Mark.FROM_DEVICE:
            for other, entry in header.devices.items():
                if other != name and entry.wire == wire:
                    self._awaited[other][frame] += 1
            yield Record(record.at_us, wire, frame)
        elif self._awaited[name][frame]:
            self._awaited[name][frame] -= 1
        else:
            yield from self._from_host(record, wire, frame)

    def _from_host(self, record: BenchRecord, wire: str, frame: CanFrame) -> Iterator[Record]:
        if record.at_us != self._at_us:
            self._at_us = record.at_us
            self._of_host.clear()
            self._received.clear()
        self._received[record.name][frame] += 1
        if self._received[record.name][frame] > self._of_host[wire, frame]:
            self._of_host[wire, frame] += 1
            yield Record(record.at_us, wire, frame, sent=True)
