"""What a log says of itself, without reading all of it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Final

from tickrig.host.monitor.logs.log_format import COMPRESSED, TEXT, LogFormat, log_format
from tickrig.host.monitor.logs.reading.log_lines import LogLines
from tickrig.host.monitor.logs.reading.log_reader import read_log
from tickrig.host.monitor.logs.tally import Tally

HEAD_FRAMES: Final = 1_000
TAIL_BYTES: Final = 1 << 14


@dataclass(frozen=True, slots=True)
class LogHead:
    """The beginning of a log, and its end where that is found at once.

    Attributes:
        kind: its format.
        compressed: it is compressed with gzip.
        size_bytes: size of the file.
        frames: how many there are; None where only a scan would tell.
        head_frames: how many were read of its beginning.
        channels: names of the buses among these.
        first_us: time of the first frame, None if there is none.
        last_us: time of the last frame, None where only a scan would tell.
        tally: what was no frame at the beginning.
    """

    kind: LogFormat
    compressed: bool
    size_bytes: int
    frames: int | None
    head_frames: int
    channels: tuple[str, ...]
    first_us: int | None
    last_us: int | None
    tally: Tally

    @property
    def whole(self) -> bool:
        """All of the log was read."""
        return self.head_frames < HEAD_FRAMES


def read_head(path: Path) -> LogHead:
    """Read the first thousand frames, and the end of a log in text.

    Raises:
        LogFormatError: the file's name tells no format.
        OSError: the file cannot be read.
        LogError: it is not what its name says.
    """
    kind, compressed = log_format(path), path.suffix.lower() == COMPRESSED
    reader = read_log(path)
    head = list(islice(reader, HEAD_FRAMES))
    whole = len(head) < HEAD_FRAMES
    last_us = head[-1].at_us if whole and head else None
    if not whole and kind in TEXT and not compressed:
        last_us = _last_us(path)
    return LogHead(
        kind,
        compressed,
        path.stat().st_size,
        len(head) if whole else None,
        len(head),
        tuple(dict.fromkeys(heard.channel for heard in head)),
        head[0].at_us if head else None,
        last_us,
        reader.tally,
    )


def _last_us(path: Path) -> int | None:
    """Return the time of the last frame of a log in text, if it is near its end."""
    with path.open("rb") as file:
        file.seek(-min(TAIL_BYTES, path.stat().st_size), os.SEEK_END)
        lines = LogLines()
        tail = lines.push(file.read()) + lines.finish()
    return tail[-1].at_us if tail and not lines.deltas else None
