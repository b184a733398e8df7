"""The files of a recording, which are numbered, limited in size, rotated, and listed in an index.

>>> plan = read_plan(Path("run.log.gz"), rotate=["100M", "10min"], disk="1G")
>>> plan.rotate_bytes, plan.rotate_us, plan.disk_bytes, plan.at_limit.value
(104857600, 600000000, 1073741824, 'oldest')
>>> plan.part(12).name, plan.index.name
('run-00012.log.gz', 'run.index.jsonl')
>>> _parse_span("post", "500ms"), _parse_span("pre", "2000")
(TriggerSpan(frames=None, us=500000), TriggerSpan(frames=2000, us=None))
"""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs import log_file
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.model.logs.log_writer import in_blocks, write_log

if TYPE_CHECKING:
    from tickrig.host.canmon.model.logs.log_writer import TextBlock


# The plan of a recording: its files, their sizes, and its trigger.


_MIN_BYTES: Final = 64 << 10
"""Smallest useful size of a file."""

_MIN_DISK_BYTES: Final = 1 << 20
_RESERVE_BYTES: Final = 256 << 10
"""Disk space that is kept free for frames that are on their way to a file."""

MAX_PRE_FRAMES: Final = 150_000
"""Maximum number of frames before a trigger.

This number is eight seconds of the busiest bus of 1 Mbit/s, some 50 MiB.
"""

_DISK_PARTS: Final = 4
"""Number of parts of limited disk space that a file may not exceed, so that the oldest can go."""

_SIZE: Final = re.compile(r"([0-9]{1,9})([kMG])")
_SHIFT: Final = {"k": 10, "M": 20, "G": 30}
_TIME: Final = re.compile(r"([0-9]{1,9}(?:\.[0-9]{1,6})?)(ms|s|min|h)")
_UNIT_US: Final = {"ms": 1_000, "s": 1_000_000, "min": 60_000_000, "h": 3_600_000_000}


class AtLimit(StrEnum):
    """Action when the disk space of a recording is used up."""

    OLDEST = "oldest"  # goes
    END = "end"


class TriggerSpan(NamedTuple):
    """Amount of traffic to record before or after a trigger: either a number of frames or a time.

    The attribute that does not apply is None.
    """

    frames: int | None
    us: int | None


DEFAULT_SPAN: Final = TriggerSpan(None, 5_000_000)


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingPlan:
    """Settings of a recording: its files, their limits, and the trigger.

    By default, the recording is the single file `path`.

    Attributes:
        path: path of the file. If the recording has parts, their names are derived from this path.
        rotate_bytes: maximum size of a part in bytes, or None for no limit.
        rotate_us: duration of a part in microseconds, or None for no limit. The part ends at the
            first frame that is at least this much later than its first frame.
        disk_bytes: maximum total size of all parts in bytes, or None for no limit.
        at_limit: action when the total size is reached.
        around: spans of traffic to record before and after a trigger, or None to record everything.
        parts: whether to record in parts, even if no setting requires it.
    """

    path: Path
    rotate_bytes: int | None = None
    rotate_us: int | None = None
    disk_bytes: int | None = None
    at_limit: AtLimit = AtLimit.OLDEST
    around: tuple[TriggerSpan, TriggerSpan] | None = None
    parts: bool = False

    @property
    def numbered(self) -> bool:
        """Whether the recording has parts and an index."""
        limits = (self.rotate_bytes, self.rotate_us, self.disk_bytes)
        return self.parts or self.around is not None or any(one is not None for one in limits)

    @property
    def index(self) -> Path:
        """Path of the index."""
        return self.path.with_name(f"{self._stem}.index.jsonl")

    def part(self, number: int) -> Path:
        """Return the path of a part by its number, from 1."""
        return self.path.with_name(f"{self._stem}-{number:05d}{self._ending}")

    def number(self, name: str) -> int:
        """Return the number of a part of the recording by its file name.

        The result is 0 if the file is not a part of the recording.
        """
        pattern = rf"{re.escape(self._stem)}-([0-9]{{5,9}}){re.escape(self._ending)}"
        match = re.fullmatch(pattern, name)
        return int(match[1]) if match else 0

    @property
    def _stem(self) -> str:
        return self.path.name.removesuffix(self._ending)

    @property
    def _ending(self) -> str:
        return log_file.log_ending(self.path)


def read_plan(  # noqa: PLR0913 - all that people may say
    path: Path,
    *,
    rotate: Sequence[str] = (),
    disk: str | None = None,
    at_limit: str | None = None,
    pre: str | None = None,
    post: str | None = None,
    waits: bool = False,
    parts: bool = False,
) -> RecordingPlan:
    """Parse the options of a recording on the command line, and return its settings.

    Args:
        path: path of the file. Parts are named after it.
        rotate: limits of a part, at most one size and one time.
        disk: limit of the total size of all parts.
        at_limit: action at the limit of the total size. `oldest` removes the oldest part, `end`
            ends the recording.
        pre: amount of traffic to record before a trigger, as frames or time.
        post: amount of traffic to record after a trigger, as frames or time.
        waits: whether the recording waits for a trigger, even without `pre` and `post`.
        parts: whether to record in parts, even if nothing else requires it.

    Raises:
        ValueError: an argument is invalid, too small, or needs another argument.
    """
    sizes = [_parse_bytes("rotate", word) for word in rotate if _SIZE.fullmatch(word)]
    times = [_rotate_us(word) for word in rotate if not _SIZE.fullmatch(word)]
    if len(sizes) > 1 or len(times) > 1:
        raise ValueError(f"rotate takes one size and one time, not {' and '.join(rotate)}")
    disk_bytes = None if disk is None else _parse_bytes("disk", disk, _MIN_DISK_BYTES)
    if at_limit is not None and disk_bytes is None:
        raise ValueError("at-limit goes with disk: it says what happens when that is used up")
    limits = [*sizes, *([disk_bytes // _DISK_PARTS] if disk_bytes else [])]
    around = None
    if waits or pre is not None or post is not None:
        around = _parse_span("pre", pre), _parse_span("post", post)
    plan = RecordingPlan(
        path=path,
        rotate_bytes=min(limits, default=None),
        rotate_us=times[0] if times else None,
        disk_bytes=disk_bytes,
        at_limit=AtLimit(at_limit or AtLimit.OLDEST),
        around=around,
        parts=parts,
    )
    kind = log_file.log_format(path)
    if plan.numbered and kind is log_file.LogFormat.MF4:
        raise ValueError(f"{path}: mf4 is written as a whole at its end; record .blf or .log")
    log_file.check_written(path, kind)
    return plan


def _parse_bytes(name: str, word: str, least: int = _MIN_BYTES) -> int:
    """Read a size with its unit.

    Raises:
        ValueError: the text is not a size, or is below `least`.
    """
    match = _SIZE.fullmatch(word)
    if match is None:
        raise ValueError(f"{name} {word!r} is no size: write 64k, 100M or 2G")
    size = int(match[1]) << _SHIFT[match[2]]
    if size < least:
        raise ValueError(
            f"{name} {word!r} is too small: at least {least >> 10}k; "
            f"rotate takes {_MIN_BYTES >> 10}k, disk {_MIN_DISK_BYTES >> 10}k or more"
        )
    return size


def _parse_span(name: str, word: str | None) -> TriggerSpan:
    """Parse a number of frames, or a time. Without a word, return 5 s.

    Raises:
        ValueError: the word is neither, or is too many frames before a trigger.
    """
    if word is None:
        return DEFAULT_SPAN
    if word.isascii() and word.isdecimal() and len(word) <= len("1000000000"):
        if name == "pre" and int(word) > MAX_PRE_FRAMES:
            raise ValueError(f"{name} {word!r}: at most {MAX_PRE_FRAMES} frames are kept")
        return TriggerSpan(int(word), None)
    if (us := _time_us(word)) is None:
        raise ValueError(
            f"{name} {word!r} is neither frames as 2000 nor a time as 500ms, 10s, 5min or 1h"
        )
    return TriggerSpan(None, us)


def _rotate_us(word: str) -> int:
    us = _time_us(word)
    if us is None:
        raise ValueError(f"rotate {word!r} is neither a size as 100M nor a time as 10min or 1h")
    if us == 0:
        raise ValueError(f"rotate {word!r} is too short: at least 1ms")
    return us


def _time_us(word: str) -> int | None:
    match = _TIME.fullmatch(word)
    if match is None:
        return None
    whole, _, fraction = match[1].partition(".")
    return int(f"{whole}{fraction:0<6}") * _UNIT_US[match[2]] // 1_000_000


# One file of a recording.

_BLOCK_US: Final = 1_000_000
"""Part of a compressed log that is lost if this program is killed."""

_READ_BYTES: Final = 32 << 20
"""Number of bytes that are read of a file when a recording continues, in a few seconds."""

_USUAL_BYTES: Final = 64
"""Assumed number of bytes of a frame, until there are some frames."""


class _RecordingPart:
    """A log that is being written, and the summary of its content.

    Args:
        path: path of the file. An existing file is replaced.

    Attributes:
        frames: number of written frames.
        safe_frames: number of frames that were passed to the operating system, and are readable.
        bytes: size of the written part of the file.
        first_us: time of the first frame, or None before it.
        last_us: time of the last frame.

    Raises:
        OSError: the file cannot be written, now or later.
        LogFormatError: the name of the file has no known format.
        LogError: the format cannot be written on this machine.
    """

    def __init__(self, path: Path) -> None:
        self.path, self._writer, self._in_blocks = path, write_log(path), in_blocks(path)
        self._write_block: Callable[[TextBlock], bool] | None
        self._write_block = getattr(self._writer, "write_block", None)  # not each format has it
        self.frames = self.safe_frames = self.bytes = 0
        self.first_us: int | None = None
        self.last_us: int | None = None
        self._safe_bytes = self._due_us = 0
        self._marks, self._lost, self._pending = Counter[str](), 0, False

    def room(self, limit: int | None) -> int:
        """Return the approximate number of frames that fit below a size."""
        if limit is None:
            return 1 << 30
        each = max(1, self.bytes // self.frames) if self.frames else _USUAL_BYTES
        return max(0, limit - self.bytes) // each

    def write(self, records: Sequence[Record]) -> None:
        """Add frames."""
        write = self._writer.write
        for record in records:
            write(record)
        self.frames += len(records)
        self.first_us = records[0].at_us if self.first_us is None else self.first_us
        self.last_us, self._pending = records[-1].at_us, True

    def write_block(self, block: TextBlock) -> bool:
        """Write many frames at once. Return False if the format needs them one by one."""
        if self._write_block is None or not self._write_block(block):
            return False
        self.frames += len(block)
        self.first_us = block.first_us if self.first_us is None else self.first_us
        self.last_us, self._pending = block.last_us, True
        return True

    def mark(self, mark: log_file.Mark) -> None:
        """Add a mark."""
        self._writer.mark(mark)
        self._marks[mark.event] += 1
        self._lost += mark.frames
        self._pending = True

    def flush(self, now_us: int) -> None:
        """Pass the written data to the operating system.

        A compressed log does so only once a second.
        """
        if not self._pending:
            return
        if self._in_blocks:
            if 0 < self._due_us - now_us <= _BLOCK_US:
                self.bytes = self.path.stat().st_size
                return
            self._due_us = now_us + _BLOCK_US
        self._writer.flush()
        self._pending, self.safe_frames = False, self.frames
        self.bytes = self._safe_bytes = self.path.stat().st_size

    def close(self) -> list[str]:
        """End the log. Return messages about items that the format could not hold."""
        self._writer.close()
        self.bytes, self.safe_frames = self.path.stat().st_size, self.frames
        return self._writer.messages()

    def rescue(self) -> None:
        """Close the log after a write error.

        Complete items stay, and an incomplete last item is removed.
        """
        with suppress(OSError, ValueError):
            self._writer.close()
        with suppress(OSError):
            if self.path.stat().st_size > self._safe_bytes:
                os.truncate(self.path, self._safe_bytes)
        self.bytes = self._safe_bytes

    def summary(self) -> dict[str, object]:
        """Return the entry of the file in the index."""
        said: dict[str, object] = {"from": None, "to": None}
        if self.first_us is not None and self.last_us is not None:
            said = {"from": self.first_us / 1e6, "to": self.last_us / 1e6}
        return {
            **said,
            "frames": self.safe_frames,
            "bytes": self.bytes,
            "lost": self._lost,
            "gaps": self._marks[log_file.BACK],
            "triggers": self._marks[log_file.TRIGGER],
        }


def _recovered(path: Path) -> dict[str, object]:
    """Return the index entry of a file that its recorder did not complete, from its content.

    A large file is not read, because new frames would have to wait.

    Raises:
        OSError: the file cannot be read.
    """
    size, frames, first_us, last_us = path.stat().st_size, 0, 0, 0
    if size > _READ_BYTES:
        return {"from": None, "to": None, "frames": None, "bytes": size, "cut": True}
    with suppress(log_file.LogError):
        for frames, record in enumerate(read_log(path), 1):  # noqa: B007 - counted
            first_us, last_us = first_us or record.at_us, record.at_us
    said = {"from": first_us / 1e6, "to": last_us / 1e6} if frames else {"from": None, "to": None}
    return {**said, "frames": frames, "bytes": size, "cut": True}


# The index of a recording: a JSON object a line about its files, gaps, losses and triggers.

_OPEN: Final = "open"
_FILE: Final = "file"
_REMOVED: Final = "removed"
_END: Final = "end"


class _Index:
    """The index file. Each line is appended at once, and an existing file is continued.

    Args:
        path: path of the file.
        is_part: function that returns whether a name is that of a part. Lines about other files are
            ignored.

    Attributes:
        files: size of each completed file that still exists. The oldest file is first.
        bytes: total size of these files.
        unended: files that were started, and neither completed nor removed.

    Raises:
        OSError: the file cannot be written, now or later.
    """

    def __init__(self, path: Path, is_part: Callable[[str], object]) -> None:
        self.files: dict[str, int] = {}
        self.bytes, self.unended = 0, list[str]()
        self._path, self._is_part = path, is_part
        text = path.read_text("utf-8", "replace") if path.exists() else ""
        for said in _objects(text):
            self._take(said)
        # Each line is one `write` in append mode: a kill leaves whole lines and at most
        # half of the last.
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
        if text and not text.endswith("\n"):  # a recorder was killed in the middle of a line
            os.write(self._file, b"\n")

    def write(self, event: str, at_us: int, **more: object) -> None:
        """Add a line."""
        said = {"v": log_file.VERSION, "ev": event, "t": at_us / 1e6, **more}
        self._take(said)
        self._put(json.dumps(said, separators=(",", ":")))

    def mark(self, mark: log_file.Mark, file: str) -> None:
        """Add a mark to the index.

        `file` is the name of the file that contains the mark, or empty if no file does.
        """
        text = mark.json()
        self._put(f'{text[:-1]},"file":{json.dumps(file)}}}' if file else text)

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)

    def _put(self, text: str) -> None:
        try:
            os.write(self._file, f"{text}\n".encode())
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(self._path)) from error

    def _take(self, said: dict[str, Any]) -> None:
        name = said.get("file")
        if not isinstance(name, str) or not self._is_part(name):
            return
        match said.get("ev"):
            case "open":
                self.unended.append(name)
            case "file" | "removed" as event:
                self.unended = [one for one in self.unended if one != name]
                self.bytes -= self.files.pop(name, 0)
                size = said.get("bytes")
                if event == _FILE and isinstance(size, int) and size >= 0:
                    self.files[name] = size
                    self.bytes += size


def _objects(text: str) -> Iterator[dict[str, Any]]:
    for line in filter(None, text.splitlines()):
        try:
            said = json.loads(line)
        except (ValueError, RecursionError):
            continue
        if isinstance(said, dict):
            yield said


# The files of a recording: numbered, of limited size, the oldest removed, in an index.

_BLOCK_FRAMES: Final = 1_024
"""Number of frames that are written between two checks of the file size."""

_LOOK_FRAMES: Final = 512
"""Number of frames that arrive between two checks of the disk space."""


class Files:
    """Writer of a recording into one file, or into parts that an index file lists.

    If an index exists already, its recording is continued. The existing parts are kept, and their
    size counts towards the maximum total size.

    Args:
        plan: settings of the recording.
        now_us: present time in microseconds.

    Attributes:
        frames: number of frames that were stored.
        parts: number of files that were started.
        removed: number of files that were removed to stay within the limits.
        ended: reason why writing ended, empty if writing continues.

    Raises:
        OSError: a file cannot be written. Methods raise it, too.
        LogError: the format cannot be written on this machine. Methods raise it, too.
    """

    def __init__(self, plan: RecordingPlan, now_us: int) -> None:
        self._plan = plan
        self.frames = self.parts = self.removed = self._safe_frames = 0
        self.ended = ""
        self._said: list[str] = []
        self._part: _RecordingPart | None = None
        self._latest_us, self._looked_frames = now_us, -_LOOK_FRAMES
        self._index = _Index(plan.index, plan.number) if plan.numbered else None
        self._number = 0
        if self._index is None:
            self._part = self._begin(now_us)
        else:
            here = [path.name for path in plan.path.parent.iterdir()]
            self._number = max(map(plan.number, (*here, *self._index.files)), default=0)
            self._recover(self._index, now_us)

    @property
    def safe_frames(self) -> int:
        """Number of frames that the operating system has, including frames of removed parts."""
        return self._safe_frames + (0 if self._part is None else self._part.safe_frames)

    @property
    def path(self) -> Path:
        """The file that is being written, or the next file."""
        return self._plan.path if self._part is None else self._part.path

    def store(self, records: Sequence[Record]) -> None:
        """Add frames in the order of arrival."""
        self.frames += len(records)
        begin, limit = 0, self._plan.rotate_bytes
        while begin < len(records) and not self.ended:
            part = self._part_for(records[begin])
            end = min(begin + min(_BLOCK_FRAMES, max(1, part.room(limit))), len(records))
            # The first frame of the next part is the one that is due; it begins that part,
            # not this one.
            end = self._up_to_due(part, records, begin, end)
            part.write(records[begin:end])
            self._latest_us = records[end - 1].at_us
            part.flush(self._latest_us)
            begin = end
            self._keep_limit()

    def store_block(self, block: TextBlock) -> bool:
        """Store many frames at once. Return False if the caller must store them one by one."""
        part = self._part
        if self._index is not None or part is None or not part.write_block(block):
            return False
        self.frames += len(block)
        self._latest_us = block.last_us
        part.flush(self._latest_us)
        return True

    def mark(self, mark: log_file.Mark) -> None:
        """Add a mark to the current file and to the index."""
        self.mark_again(mark)
        if self._index is not None:
            self._index.mark(mark, "" if self._part is None else self._part.path.name)

    def mark_again(self, mark: log_file.Mark) -> None:
        """Write a mark to the current file, but not to the index, which has the mark already."""
        if self._part is not None:
            self._part.mark(mark)

    def flush(self, now_us: int) -> None:
        """Pass the written data to the operating system."""
        if self._part is not None:
            self._part.flush(now_us)

    def end_part(self) -> None:
        """End the current file. The next frame begins another file."""
        part = self._part
        if part is None:
            return
        self._said += part.close()
        self._part = None
        self._safe_frames += part.safe_frames
        if self._index is not None:
            self._index.write(_FILE, self._latest_us, file=part.path.name, **part.summary())

    def rescue(self, why: str) -> None:
        """End the recording after an error, and leave files that can be read.

        Args:
            why: reason for the end.
        """
        part, self._part = self._part, None
        if part is not None:
            part.rescue()
            self._safe_frames += part.safe_frames
        if self._index is not None:
            with suppress(OSError):
                if part is not None:
                    said = {"file": part.path.name, **part.summary(), "cut": True}
                    self._index.write(_FILE, self._latest_us, **said)
                self._index.write(_END, self._latest_us, why=why)
            self._index.close()

    def close(self, why: str) -> None:
        """End the recording."""
        self.end_part()
        if self._index is not None:
            self._index.write(_END, self._latest_us, why=why)
            self._index.close()

    def messages(self) -> list[str]:
        """Report items that formats could not hold, and remains of an earlier recording."""
        return self._said

    def _part_for(self, record: Record) -> _RecordingPart:
        part = self._part
        if part is not None and part.frames and self._is_full(part, record.at_us):
            self.end_part()
            part = None
        if part is None:
            part = self._part = self._begin(record.at_us)
        return part

    def _is_full(self, part: _RecordingPart, at_us: int) -> bool:
        if self._index is None:
            return False
        if part.room(self._plan.rotate_bytes) <= 0:
            return True
        after_us, first_us = self._plan.rotate_us, part.first_us
        return after_us is not None and first_us is not None and at_us - first_us >= after_us

    def _up_to_due(
        self, part: _RecordingPart, records: Sequence[Record], begin: int, end: int
    ) -> int:
        """Return the position of the first of these frames that belongs to the next file."""
        after_us = self._plan.rotate_us
        if after_us is None:
            return end
        first_us = records[begin].at_us if part.first_us is None else part.first_us
        if records[end - 1].at_us - first_us < after_us:
            return end
        due = bisect_left(records, first_us + after_us, begin, end, key=lambda one: one.at_us)
        return max(due, begin + 1)

    def _begin(self, at_us: int) -> _RecordingPart:
        path = self._plan.path
        if self._index is not None:
            self._number += 1
            path = self._plan.part(self._number)
            # Before the file exists: a recorder that is killed here leaves a name to look
            # for (`_recover`).
            self._index.write(_OPEN, at_us, file=path.name)
        self.parts += 1
        return _RecordingPart(path)

    def _recover(self, index: _Index, now_us: int) -> None:
        """Add files to the index that a killed recorder did not complete."""
        for name in list(index.unended):
            path = self._plan.path.with_name(name)
            if path.is_file():
                found = _recovered(path)
                index.write(_FILE, now_us, file=name, **found)
                self._said.append(f"{name} was not ended by its recorder: {_readable(found)}")
            else:
                index.write(_REMOVED, now_us, file=name)

    def _keep_limit(self) -> None:
        """Remove the oldest files, or end the recording, if disk space is used up."""
        index, disk_bytes = self._index, self._plan.disk_bytes
        if index is None:
            return
        part = self._part
        under_way = 0 if part is None else part.bytes
        while disk_bytes is not None:
            # The part under way counts; `_RESERVE_BYTES` is for frames that are not written
            # yet.
            if index.bytes + under_way + _RESERVE_BYTES <= disk_bytes:
                break
            if self._plan.at_limit is AtLimit.END or not self._remove_oldest(index):
                self.ended = f"{disk_bytes} bytes of disk space are used up"
                return
        if self._looked_frames + _LOOK_FRAMES > self.frames:
            return
        self._looked_frames = self.frames
        # The disk of others may fill up, too: own old parts go if the plan allows that,
        # else the end is clean.
        while shutil.disk_usage(self._plan.path.parent).free < _RESERVE_BYTES:
            may_remove = disk_bytes is not None and self._plan.at_limit is AtLimit.OLDEST
            if not (may_remove and self._remove_oldest(index)):
                path = str(self.path)
                self.end_part()  # there is room for that
                left = f"{_RESERVE_BYTES >> 10} KiB are left on the disk"
                raise OSError(errno.ENOSPC, left, path)

    def _remove_oldest(self, index: _Index) -> bool:
        """Remove a file. Return whether the file existed."""
        if not index.files:
            return False
        name = next(iter(index.files))
        self._plan.path.with_name(name).unlink(missing_ok=True)
        index.write(_REMOVED, self._latest_us, file=name)
        self.removed += 1
        return True


def _readable(found: dict[str, object]) -> str:
    """Return the readable content of a file that was not completed."""
    if found["frames"] is None:
        return f"it has {found['bytes']} bytes; what came behind them is missing"
    last = "" if found["to"] is None else f", the last of {found['to']} s"
    return f"{found['frames']} frames can be read{last}; what came behind is missing"
