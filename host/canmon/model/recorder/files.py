"""The files of a recording: numbered, of limited size, the oldest removed, in an index."""

from __future__ import annotations

import errno
import shutil
from bisect import bisect_left
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.logs.mark import Mark
from tickrig.host.canmon.model.recorder.index import END, FILE, OPEN, REMOVED, Index
from tickrig.host.canmon.model.recorder.part import Part, recovered
from tickrig.host.canmon.model.recorder.plan import RESERVE_BYTES, AtLimit, Plan

BLOCK_FRAMES: Final = 1_024
"""Frames that are written between two looks at sizes."""

LOOK_FRAMES: Final = 512
"""Frames that come between two looks at the space on the disk."""


class Files:
    """Writes frames and marks into one file, or into parts of which each is in the index.

    A recording whose index is there already is gone on with: its parts stay, and count.

    Args:
        plan: what it shall be.
        now_us: the time.

    Attributes:
        frames: how many were given; all of them were to be in files.
        parts: how many files were begun.
        removed: how many had to go.
        ended: why no more is written; empty while all is well.

    Raises:
        OSError: a file cannot be written, now or later.
        LogError: the format cannot be written here, likewise.
    """

    def __init__(self, plan: Plan, now_us: int) -> None:
        self._plan = plan
        self.frames = self.parts = self.removed = self._safe_frames = 0
        self.ended = ""
        self._said: list[str] = []
        self._part: Part | None = None
        self._latest_us, self._looked_frames = now_us, -LOOK_FRAMES
        self._index = Index(plan.index, plan.number) if plan.numbered else None
        self._number = 0
        if self._index is None:
            self._part = self._begin(now_us)
        else:
            self._number = max(0, *self._numbers())
            self._recover(self._index, now_us)

    @property
    def safe_frames(self) -> int:
        """How many frames the operating system has, or the parts that were removed had."""
        return self._safe_frames + (0 if self._part is None else self._part.safe_frames)

    @property
    def path(self) -> Path:
        """The file that is written, or would be next."""
        return self._plan.path if self._part is None else self._part.path

    def store(self, records: Sequence[Record]) -> None:
        """Add frames, in the order in which they came."""
        self.frames += len(records)
        begin = 0
        while begin < len(records) and not self.ended:
            part = self._part_for(records[begin])
            end = min(begin + min(BLOCK_FRAMES, max(1, self._room(part))), len(records))
            end = self._up_to_due(part, records, begin, end)
            part.write(records[begin:end])
            self._latest_us = records[end - 1].at_us
            part.flush(self._latest_us)
            begin = end
            self._keep_limit()

    def mark(self, mark: Mark) -> None:
        """Add a mark to the file that is under way, and to the index."""
        if self._part is not None:
            self._part.mark(mark)
        if self._index is not None:
            self._index.mark(mark, "" if self._part is None else self._part.path.name)

    def mark_again(self, mark: Mark) -> None:
        """Add a mark to the file that is under way; the index has it."""
        if self._part is not None:
            self._part.mark(mark)

    def flush(self, now_us: int) -> None:
        """Give to the operating system what was written."""
        if self._part is not None:
            self._part.flush(now_us)

    def end_part(self) -> None:
        """End the file that is under way; the next frame begins another."""
        part = self._part
        if part is None:
            return
        self._said += part.close()
        self._part = None
        self._safe_frames += part.safe_frames
        if self._index is not None:
            self._index.write(FILE, self._latest_us, file=part.path.name, **part.summary())

    def rescue(self, why: str) -> None:
        """End the recording after an error, so that what is in files can be read."""
        part, self._part = self._part, None
        if part is not None:
            part.rescue()
            self._safe_frames += part.safe_frames
        if self._index is not None:
            with suppress(OSError):
                if part is not None:
                    said = {**part.summary(), "frames": part.safe_frames, "cut": True}
                    self._index.write(FILE, self._latest_us, file=part.path.name, **said)
                self._index.write(END, self._latest_us, why=why)
            self._index.close()

    def close(self, why: str) -> None:
        """End the recording."""
        self.end_part()
        if self._index is not None:
            self._index.write(END, self._latest_us, why=why)
            self._index.close()

    def messages(self) -> list[str]:
        """Say what formats could not hold, and what was found of an earlier recording."""
        return self._said

    def _part_for(self, record: Record) -> Part:
        part = self._part
        if part is not None and part.frames and self._is_full(part, record.at_us):
            self.end_part()
            part = None
        if part is None:
            part = self._part = self._begin(record.at_us)
        return part

    def _room(self, part: Part) -> int:
        return part.room(self._plan.rotate_bytes)

    def _is_full(self, part: Part, at_us: int) -> bool:
        if self._index is None or self._room(part) <= 0:
            return self._index is not None
        after_us, first_us = self._plan.rotate_us, part.first_us
        return after_us is not None and first_us is not None and at_us - first_us >= after_us

    def _up_to_due(self, part: Part, records: Sequence[Record], begin: int, end: int) -> int:
        """Return where the first of these frames is that belongs into the next file."""
        after_us = self._plan.rotate_us
        if after_us is None:
            return end
        first_us = records[begin].at_us if part.first_us is None else part.first_us
        if records[end - 1].at_us - first_us < after_us:
            return end
        due = bisect_left(records, first_us + after_us, begin, end, key=lambda one: one.at_us)
        return max(due, begin + 1)

    def _begin(self, at_us: int) -> Part:
        path = self._plan.path
        if self._index is not None:
            self._number += 1
            path = self._plan.part(self._number)
            self._index.write(OPEN, at_us, file=path.name)
        self.parts += 1
        return Part(path)

    def _numbers(self) -> list[int]:
        assert self._index is not None, "there are numbers where there is an index"
        here = [path.name for path in self._plan.path.parent.iterdir()]
        return [self._plan.number(name) for name in (*here, *self._index.files)] or [0]

    def _recover(self, index: Index, now_us: int) -> None:
        """Put files into the index that a recorder was killed at."""
        for name in list(index.unended):
            path = self._plan.path.with_name(name)
            if path.is_file():
                found = recovered(path)
                index.write(FILE, now_us, file=name, **found)
                self._said.append(f"{name} was not ended by its recorder: {_readable(found)}")
            else:
                index.write(REMOVED, now_us, file=name)

    def _keep_limit(self) -> None:
        """Remove the oldest files, or end, where disk space is used up."""
        index, disk_bytes = self._index, self._plan.disk_bytes
        if index is None:
            return
        part = self._part
        under_way = 0 if part is None else part.bytes
        while disk_bytes is not None:
            if index.bytes + under_way + RESERVE_BYTES <= disk_bytes:
                break
            if self._plan.at_limit is AtLimit.END or not self._remove_oldest(index):
                self.ended = f"{disk_bytes} bytes of disk space are used up"
                return
        if self._looked_frames + LOOK_FRAMES > self.frames:
            return
        self._looked_frames = self.frames
        while shutil.disk_usage(self._plan.path.parent).free < RESERVE_BYTES:
            may_remove = disk_bytes is not None and self._plan.at_limit is AtLimit.OLDEST
            if not (may_remove and self._remove_oldest(index)):
                path = str(self.path)
                self.end_part()  # there is room for that
                left = f"{RESERVE_BYTES >> 10} KiB are left on the disk"
                raise OSError(errno.ENOSPC, left, path)

    def _remove_oldest(self, index: Index) -> bool:
        """Remove a file; say whether there was one."""
        if not index.files:
            return False
        name = next(iter(index.files))
        self._plan.path.with_name(name).unlink(missing_ok=True)
        index.write(REMOVED, self._latest_us, file=name)
        self.removed += 1
        return True


def _readable(found: dict[str, object]) -> str:
    """Say what can be read of a file that was not ended."""
    if found["frames"] is None:
        return f"it has {found['bytes']} bytes; what came behind them is missing"
    last = "" if found["to"] is None else f", the last of {found['to']} s"
    return f"{found['frames']} frames can be read{last}; what came behind is missing"
