"""What a recording shall be: its files, their sizes, and what it waits for.

>>> plan = read_plan(Path("run.log.gz"), rotate=["100M", "10min"], disk="1G")
>>> plan.rotate_bytes, plan.rotate_us, plan.disk_bytes, plan.at_limit.value
(104857600, 600000000, 1073741824, 'oldest')
>>> plan.part(12).name, plan.index.name
('run-00012.log.gz', 'run.index.jsonl')
>>> _parse_span("post", "500ms"), _parse_span("pre", "2000")
(TriggerSpan(frames=None, us=500000), TriggerSpan(frames=2000, us=None))
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Final, NamedTuple

from tickrig.host.canmon.model.logs.log_file import COMPRESSED, LogFormat, log_ending, log_format

_MIN_BYTES: Final = 64 << 10
"""Of a file: smaller ones are no use."""

_MIN_DISK_BYTES: Final = 1 << 20
RESERVE_BYTES: Final = 256 << 10
"""Room that is kept free: for frames that are on their way to a file."""

MAX_PRE_FRAMES: Final = 150_000
"""Eight seconds of the busiest bus of 1 Mbit/s, some 50 MiB."""

_DISK_PARTS: Final = 4
"""Where disk space is limited a file is no larger than this part of it: the oldest can go."""

_SIZE: Final = re.compile(r"([0-9]{1,9})([kMG])")
_SHIFT: Final = {"k": 10, "M": 20, "G": 30}
_TIME: Final = re.compile(r"([0-9]{1,9}(?:\.[0-9]{1,6})?)(ms|s|min|h)")
_UNIT_US: Final = {"ms": 1_000, "s": 1_000_000, "min": 60_000_000, "h": 3_600_000_000}


class AtLimit(StrEnum):
    """What happens where the disk space of a recording is used up."""

    OLDEST = "oldest"  # goes
    END = "end"


class TriggerSpan(NamedTuple):
    """Before or behind a trigger: so many frames, or so long; the other is None."""

    frames: int | None
    us: int | None


DEFAULT_SPAN: Final = TriggerSpan(None, 5_000_000)


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingPlan:
    """A recording; without any of its settings it is the file `path`, and nothing else.

    Attributes:
        path: of the file, or what its parts are named after.
        rotate_bytes: a part is ended before it grows larger; None for no limit.
        rotate_us: a part is ended at the first frame that is so much later than its first.
        disk_bytes: all parts together are no larger.
        at_limit: what happens there.
        around: what is kept before a trigger, and recorded behind it; None to record all.
        parts: it is in parts, though no setting asks for that.
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
        """Whether it has parts and an index."""
        limits = (self.rotate_bytes, self.rotate_us, self.disk_bytes)
        return self.parts or self.around is not None or any(one is not None for one in limits)

    @property
    def index(self) -> Path:
        """Its index."""
        return self.path.with_name(f"{self._stem}.index.jsonl")

    def part(self, number: int) -> Path:
        """Return its part of a number, from 1."""
        return self.path.with_name(f"{self._stem}-{number:05d}{self._ending}")

    def number(self, name: str) -> int:
        """Return the number of a part; 0 if it is none."""
        pattern = rf"{re.escape(self._stem)}-([0-9]{{5,9}}){re.escape(self._ending)}"
        match = re.fullmatch(pattern, name)
        return int(match[1]) if match else 0

    @property
    def _stem(self) -> str:
        return self.path.name.removesuffix(self._ending)

    @property
    def _ending(self) -> str:
        return log_ending(self.path)


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
    """Read what people say of a recording.

    Args:
        path: the file; parts are named after it.
        rotate: sizes and times, one of each at the most.
        disk: size of all parts.
        at_limit: `oldest` or `end`.
        pre: before a trigger.
        post: behind it.
        waits: it waits for a trigger, also where nothing is said of `pre` and `post`.
        parts: it is in parts, also where nothing else asks for that.

    Raises:
        ValueError: one that is none, too small, or goes with none of the others.
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
    kind = log_format(path)
    if kind is LogFormat.BLF and path.suffix.lower() == COMPRESSED:
        raise ValueError(f"{path}: blf is compressed by itself, it is not written with .gz")
    if kind is LogFormat.PCAP:
        raise ValueError(f"{path}: pcap is read alone; a name in .pcapng is written")
    if plan.numbered and kind is LogFormat.MF4:
        raise ValueError(f"{path}: mf4 is written as a whole at its end; record .blf or .log")
    return plan


def _parse_bytes(name: str, word: str, least: int = _MIN_BYTES) -> int:
    """Read a size with its unit.

    Raises:
        ValueError: it is none, or below `least`.
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
    """Read a number of frames, or a time; without a word 5 s.

    Raises:
        ValueError: it is neither, or too many frames before a trigger.
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
