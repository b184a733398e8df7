"""Log files that python-can writes: ASC, BLF, TRC and, with asammdf, MF4."""

from __future__ import annotations

import io
import os
import time
from collections import Counter
from datetime import datetime
from pathlib import Path
from typing import Any, Final, TextIO

import can
from can.io.blf import FILE_HEADER_SIZE
from can.util import channel2int, len2dlc

from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.logs.can_record import to_can
from tickrig.host.canmon.model.logs.log_file import (
    COMPRESSED,
    NO_MF4,
    LogError,
    LogFormat,
    open_log,
)
from tickrig.host.canmon.model.logs.log_writer import BusNumbers
from tickrig.host.canmon.model.logs.mark import Mark
from tickrig.wire.can_error import ErrorFrame

FD_FLAGS: Final = 0x1000
"""A CAN FD frame in ASC; the bits above it say BRS and ESI."""

TRC_TYPES: Final = {
    (False, False): "FD",
    (True, False): "FB",
    (False, True): "BI",
    (True, True): "FE",
}
"""Types of CAN FD frames in TRC by BRS and ESI."""

_DATE: Final = "%a %b %d %H:%M:%S.{:03d} %Y"
_END: Final = "End TriggerBlock\n"


class AscWriter:
    """Begins at a millisecond of local time; a frame from before begins another block.

    python-can's own dates the file with the time of writing, writes 5 ms of a date as `.5`, and a
    frame from before the start with its absolute time.

    Args:
        file: a text file, which is closed with the log.
    """

    def __init__(self, file: TextIO) -> None:
        self._file = file
        self._begin_us: int | None = None

    def on_message_received(self, message: can.Message) -> None:
        """Write a frame."""
        at_us = round(message.timestamp * 1e6)
        if self._begin_us is None or at_us < self._begin_us:
            self._begin(at_us)
        assert self._begin_us is not None, "it has begun"
        seconds, micros = divmod(at_us - self._begin_us, 1_000_000)
        self._file.write(f"{seconds:4d}.{micros:06d} {_event(message)}\n")

    def mark(self, mark: Mark) -> None:
        """Write a comment."""
        if self._begin_us is None:
            self._begin(mark.at_us)
        self._file.write(f"// {mark.text}\n")

    def flush(self) -> None:
        """There is nothing but the file."""

    def stop(self) -> None:
        """End the log."""
        if self._begin_us is None:
            self._begin(time.time_ns() // 1_000)
        self._file.write(_END)
        self._file.close()

    def _begin(self, at_us: int) -> None:
        start = datetime.fromtimestamp(at_us // 1_000 / 1e3)
        date = start.strftime(_DATE).format(start.microsecond // 1_000)
        if self._begin_us is None:
            self._file.write(f"date {date}\nbase hex  timestamps absolute\n")
            self._file.write("internal events logged\n")
        else:
            self._file.write(_END)
        self._file.write(f"Begin Triggerblock {date}\n   0.000000 Start of measurement\n")
        # of an hour that the clock of the wall shows twice the text says the first
        self._begin_us = round(start.replace(fold=0).timestamp() * 1e6)


def _event(message: can.Message) -> str:
    assert isinstance(message.channel, int), "who writes numbers the buses"
    channel = message.channel + 1
    if message.is_error_frame:
        return f"{channel}  ErrorFrame"
    ident = f"{message.arbitration_id:X}{'x' * message.is_extended_id}"
    direction = "Rx" if message.is_rx else "Tx"
    if message.is_fd:
        return _fd_event(message, channel, ident, direction)
    kind = "r" if message.is_remote_frame else "d"
    data = f" {message.data.hex(' ').upper()}" if message.data else ""
    return f"{channel}  {ident:<15} {direction:<4} {kind} {message.dlc:x}{data}"


def _fd_event(message: can.Message, channel: int, ident: str, direction: str) -> str:
    """Write what stands behind the time; durations, bit timings and CRC, never told, are 0."""
    brs, esi = int(message.bitrate_switch), int(message.error_state_indicator)
    flags = FD_FLAGS * (1 + 2 * brs + 4 * esi)
    data = f" {message.data.hex(' ').upper()}" if message.data else ""
    return (
        f"CANFD {channel:>3} {direction:<4} {ident:>8}  {'':>32} {brs} {esi}"
        f" {len2dlc(message.dlc):x} {message.dlc:>2}{data} {0:>8} {0:>4} {flags:8X} 0 0 0 0 0"
    )


FIRST_BLF_S: Final = 631_152_000
"""1990-01-01; python-can takes a time before it for one that counts from zero."""

TRC_STEP_US: Final = 10_546_875
"""2**-13 days: a multiple of it is exact as the fraction of a day that TRC begins with."""


class TrcWriter(can.TRCWriter):
    """Begins at a multiple of `TRC_STEP_US`: a date that the text holds to the microsecond."""

    def on_message_received(self, msg: can.Message) -> None:
        """Write a frame."""
        self._begin(int(msg.timestamp * 1e6))
        if not msg.is_fd:
            super().on_message_received(msg)
            return
        self.msgnr += 1
        self.file.write(_fd_trc_line(msg, self.msgnr, self.first_timestamp or 0.0))

    def mark(self, mark: Mark) -> None:
        """Write a comment."""
        self._begin(mark.at_us)
        self.file.write(f";   {mark.text}\n")

    def flush(self) -> None:
        """There is nothing but the file."""

    def _begin(self, at_us: int) -> None:
        if self.first_timestamp is None:
            self.first_timestamp = at_us // TRC_STEP_US * TRC_STEP_US / 1e6
            self.write_header(self.first_timestamp)


def _fd_trc_line(message: can.Message, number: int, begin_s: float) -> str:
    """Write the line of a frame, which python-can reads but does not write."""
    kind = TRC_TYPES[message.bitrate_switch, message.error_state_indicator]
    offset_ms = (message.timestamp - begin_s) * 1000
    ident = f"{message.arbitration_id:0{7 if message.is_extended_id else 4}X}"
    direction, channel = "Rx" if message.is_rx else "Tx", (channel2int(message.channel) or 0) + 1
    return (
        f"{number:>7} {offset_ms:13.3f} {kind} {channel:>2} {ident:>8} {direction} -  "
        f"{len2dlc(message.dlc):<4} {message.data.hex(' ').upper()}\n"
    )


class BlfWriter(can.BLFWriter):
    """Begins at a second; BLF holds nothing from before.

    Attributes:
        early: frames from before, which have got the time of the beginning.
    """

    early = 0
    _dated = False

    def on_message_received(self, msg: can.Message) -> None:
        """Write a frame."""
        start = self.start_timestamp
        self.early += msg.timestamp < (self._begin(msg.timestamp) if start is None else start)
        super().on_message_received(msg)

    def mark(self, mark: Mark) -> None:
        """Write a marker."""
        at_s = mark.at_us / 1e6
        self.log_event(mark.text, max(at_s, self._begin(at_s)))

    def flush(self) -> None:
        """End a container: what is in it can be read if no end follows.

        python-can's own tells when the log began in its end alone.
        """
        self._flush()
        if not self._dated and self.start_timestamp is not None:
            self._dated = True
            self.file.seek(0)
            self._write_header(FILE_HEADER_SIZE)  # the size of a log without an end
            self.file.seek(0, os.SEEK_END)

    def _begin(self, at_s: float) -> float:
        if self.start_timestamp is None:
            begin_s = int(at_s)
            self.start_timestamp = float(begin_s if begin_s >= FIRST_BLF_S else 0)
        return self.start_timestamp


class Mf4Writer(can.MF4Writer):
    """Is written as a whole at its end."""

    def flush(self) -> None:
        """There is nothing to give yet."""


TEXT: Final[dict[LogFormat, Any]] = {
    LogFormat.ASC: AscWriter,
    LogFormat.TRC: TrcWriter,
}
BINARY: Final[dict[LogFormat, Any]] = {LogFormat.BLF: BlfWriter, LogFormat.MF4: Mf4Writer}

END_US: Final = 16_725_225_600_000_000
"""The year 2500: dates of ASC and TRC go on to 9999, nanoseconds of BLF to 2554."""

MARKS: Final = "marks of gaps and triggers"


class CanLogWriter:
    """A log that python-can writes.

    These formats number their buses: `can3` is number 3, others take free numbers,
    and `words` says which.

    Raises:
        LogError: python-can cannot write it here.
        OSError: the file cannot be written.
    """

    def __init__(self, path: Path, kind: LogFormat) -> None:
        if kind in BINARY and path.suffix.lower() == COMPRESSED:
            raise LogError(f"{path}: {kind} is compressed by itself, it is not written with .gz")
        self._path, self._kind, self._closed = path, kind, False
        self._numbers = BusNumbers()
        self._passed_over: Counter[str] = Counter()
        self._file: Any = open_log(path, "wb")
        if kind in TEXT:
            self._file = _Text(self._file, str(path))
        try:
            self._writer: Any = (TEXT | BINARY)[kind](self._file)
        except NotImplementedError as error:
            self._file.close()
            path.unlink()
            raise LogError(f"{path}: {NO_MF4}") from error

    def write(self, record: Record, /) -> None:
        """Add a frame."""
        if what := _not_held(record, self._kind):
            self._passed_over[what] += 1
            if self._kind is LogFormat.TRC or record.at_us >= END_US:
                return
        self._writer.on_message_received(to_can(record, self._numbers.number(record.channel)))

    def mark(self, mark: Mark, /) -> None:
        """Add a comment or marker, or count it."""
        if self._kind is LogFormat.MF4 or mark.at_us >= END_US:
            self._passed_over[MARKS] += 1
        else:
            self._writer.mark(mark)

    def flush(self) -> None:
        """Give what was added to the operating system; the end of some formats is still missing."""
        self._writer.flush()
        self._file.flush()

    def close(self) -> None:
        """End the log."""
        if not self._closed:
            self._closed = True
            try:
                self._writer.stop()
            finally:
                self._file.close()

    def messages(self) -> list[str]:
        """Say what the format could not hold."""
        named = self._path.name
        said = [f"{named}: {count} {what} left out" for what, count in self._passed_over.items()]
        said += self._numbers.messages(named)
        if isinstance(self._writer, BlfWriter) and self._writer.early:
            said.append(f"{named}: {self._writer.early} frames from before its start moved there")
        return said


class _Text(io.TextIOWrapper):
    """A text file that knows its path, as the header of TRC wants it."""

    def __init__(self, file: Any, name: str) -> None:
        super().__init__(file, "utf-8", newline="")
        self._name = name

    @property
    def name(self) -> str:
        return self._name


def _not_held(record: Record, kind: LogFormat) -> str:
    """Return what a format cannot hold; empty if it can."""
    if record.at_us >= END_US:
        return "frames of the year 2500 and later"
    if isinstance(record.frame, ErrorFrame):
        return {LogFormat.TRC: "error frames", LogFormat.ASC: "classes of error frames"}.get(
            kind, ""
        )
    return "remote frames" if kind is LogFormat.TRC and record.frame.remote else ""
