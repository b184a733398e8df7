"""Log files that python-can writes: ASC, BLF, TRC and, with asammdf, MF4."""

from __future__ import annotations

import io
import re
from collections import Counter
from pathlib import Path
from typing import Any, Final

import can

from tickrig.host.monitor.frames.heard import Heard
from tickrig.host.monitor.logs.log_format import COMPRESSED, LogFormat
from tickrig.host.monitor.logs.reading.can_heard import to_can
from tickrig.host.monitor.logs.reading.log_reader import LogError
from tickrig.host.monitor.logs.writing.asc_writer import AscWriter
from tickrig.host.monitor.logs.writing.can_writers import BlfWriter, TrcWriter
from tickrig.host.monitor.logs.writing.log_writer import create
from tickrig.wire.can_error import ErrorFrame

TEXT: Final[dict[LogFormat, Any]] = {
    LogFormat.ASC: AscWriter,
    LogFormat.TRC: TrcWriter,
}
BINARY: Final[dict[LogFormat, Any]] = {LogFormat.BLF: BlfWriter, LogFormat.MF4: can.MF4Writer}

END_US: Final = 16_725_225_600_000_000
"""The year 2500: dates of ASC and TRC go on to 9999, nanoseconds of BLF to 2554."""

_NUMBER: Final = re.compile(r"can([0-9]{1,3})")


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
        self._numbers: dict[str, int] = {}
        self._passed_over: Counter[str] = Counter()
        self._file: Any = create(path)
        if kind in TEXT:
            self._file = _Text(self._file, str(path))
        try:
            self._writer: Any = (TEXT | BINARY)[kind](self._file)
        except NotImplementedError as error:
            self._file.close()
            path.unlink()
            raise LogError(f"{path}: {' '.join(str(error).split())}") from error

    def write(self, heard: Heard, /) -> None:
        """Add a frame."""
        if what := _not_held(heard, self._kind):
            self._passed_over[what] += 1
            if self._kind is LogFormat.TRC or heard.at_us >= END_US:
                return
        self._writer.on_message_received(to_can(heard, self._number(heard.channel)))

    def flush(self) -> None:
        """Give what was added to the operating system; the end of some formats is still missing."""
        self._file.flush()

    def close(self) -> None:
        """End the log."""
        if not self._closed:
            self._closed = True
            self._writer.stop()
            self._file.close()

    def words(self) -> list[str]:
        """Say what the format could not hold."""
        named = self._path.name
        said = [f"{named}: {count} {what} left out" for what, count in self._passed_over.items()]
        said += [
            f"{named}: {name} became can{number}"
            for name, number in self._numbers.items()
            if name != f"can{number}"
        ]
        if isinstance(self._writer, BlfWriter) and self._writer.early:
            said.append(f"{named}: {self._writer.early} frames from before its start moved there")
        return said

    def _number(self, channel: str) -> int:
        if channel not in self._numbers:
            match = _NUMBER.fullmatch(channel)
            number = int(match[1]) if match else 0
            while number in self._numbers.values():
                number += 1
            self._numbers[channel] = number
        return self._numbers[channel]


class _Text(io.TextIOWrapper):
    """A text file that knows its path, as the header of TRC wants it."""

    def __init__(self, file: Any, name: str) -> None:
        super().__init__(file, "utf-8", newline="")
        self._name = name

    @property
    def name(self) -> str:
        return self._name


def _not_held(heard: Heard, kind: LogFormat) -> str:
    """Return what a format cannot hold; empty if it can."""
    if heard.at_us >= END_US:
        return "frames of the year 2500 and later"
    if isinstance(heard.frame, ErrorFrame):
        return {LogFormat.TRC: "error frames", LogFormat.ASC: "classes of error frames"}.get(
            kind, ""
        )
    return "remote frames" if kind is LogFormat.TRC and heard.frame.remote else ""
