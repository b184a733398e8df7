"""One file of a recording."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.logs.log_file import LogError
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.model.logs.log_writer import in_blocks, write_log
from tickrig.host.canmon.model.logs.mark import BACK, TRIGGER, Mark

BLOCK_US: Final = 1_000_000
"""How much of a compressed log is lost where this program is killed."""

READ_BYTES: Final = 32 << 20
"""Of a file that is read when a recording goes on: a few seconds."""

USUAL_BYTES: Final = 64
"""Of a frame, until there are some."""


class Part:
    """A log under way, and what is in it.

    Args:
        path: the file; one that exists is replaced.

    Attributes:
        frames: how many were written.
        safe_frames: how many of them the operating system has, so that they can be read.
        bytes: size of the file, as far as it is written.
        first_us: when the first frame came; None before it.
        last_us: when the last one came.

    Raises:
        OSError: it cannot be written, now or later.
        LogFormatError: its name tells no format.
        LogError: its format cannot be written here.
    """

    def __init__(self, path: Path) -> None:
        self.path, self._writer, self._in_blocks = path, write_log(path), in_blocks(path)
        self.frames = self.safe_frames = self.bytes = 0
        self.first_us: int | None = None
        self.last_us: int | None = None
        self._safe_bytes = self._due_us = 0
        self._marks, self._lost, self._pending = Counter[str](), 0, False

    def room(self, limit: int | None) -> int:
        """Return how many frames there is room for below a size, at least about."""
        if limit is None:
            return 1 << 30
        each = max(1, self.bytes // self.frames) if self.frames else USUAL_BYTES
        return max(0, limit - self.bytes) // each

    def write(self, records: Sequence[Record]) -> None:
        """Add frames."""
        write = self._writer.write
        for record in records:
            write(record)
        self.frames += len(records)
        self.first_us = records[0].at_us if self.first_us is None else self.first_us
        self.last_us, self._pending = records[-1].at_us, True

    def mark(self, mark: Mark) -> None:
        """Add a mark."""
        self._writer.mark(mark)
        self._marks[mark.event] += 1
        self._lost += mark.frames
        self._pending = True

    def flush(self, now_us: int) -> None:
        """Give to the operating system what was written; what is compressed, once a second."""
        if not self._pending:
            return
        if self._in_blocks:
            if 0 < self._due_us - now_us <= BLOCK_US:
                self.bytes = self.path.stat().st_size
                return
            self._due_us = now_us + BLOCK_US
        self._writer.flush()
        self._pending, self.safe_frames = False, self.frames
        self.bytes = self._safe_bytes = self.path.stat().st_size

    def close(self) -> list[str]:
        """End the log; return what it could not hold."""
        self._writer.close()
        self.bytes, self.safe_frames = self.path.stat().st_size, self.frames
        return self._writer.messages()

    def rescue(self) -> None:
        """End it after an error: what is whole stays, and half a frame behind it goes."""
        with suppress(OSError, ValueError):
            self._writer.close()
        with suppress(OSError):
            if self.path.stat().st_size > self._safe_bytes:
                os.truncate(self.path, self._safe_bytes)
        self.bytes = self._safe_bytes

    def summary(self) -> dict[str, object]:
        """Return what an index says of it."""
        said: dict[str, object] = {"from": None, "to": None}
        if self.first_us is not None and self.last_us is not None:
            said = {"from": self.first_us / 1e6, "to": self.last_us / 1e6}
        return {
            **said,
            "frames": self.safe_frames,
            "bytes": self.bytes,
            "lost": self._lost,
            "gaps": self._marks[BACK],
            "triggers": self._marks[TRIGGER],
        }


def recovered(path: Path) -> dict[str, object]:
    """Return what an index says of a file that its recorder could not end: what can be read.

    A large one is not read: frames come meanwhile, and wait.

    Raises:
        OSError: it cannot be read.
    """
    size, frames, first_us, last_us = path.stat().st_size, 0, 0, 0
    if size > READ_BYTES:
        return {"from": None, "to": None, "frames": None, "bytes": size, "cut": True}
    with suppress(LogError):
        for frames, record in enumerate(read_log(path), 1):  # noqa: B007 - counted
            first_us, last_us = first_us or record.at_us, record.at_us
    said = {"from": first_us / 1e6, "to": last_us / 1e6} if frames else {"from": None, "to": None}
    return {**said, "frames": frames, "bytes": size, "cut": True}
