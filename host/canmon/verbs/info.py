"""The verb `info`, which describes a log from its head alone."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import Final

import click

from tickrig.host.canmon.model.logs import log_file
from tickrig.host.canmon.model.logs.log_file import LogFormat, LogTally
from tickrig.host.canmon.model.logs.log_reader import LogLines, read_log
from tickrig.host.cli.messages import Refused, SourceFailed
from tickrig.host.cli.options import PATH
from tickrig.host.text.page_text import json_text

_HEAD_FRAMES: Final = 1_000
_TAIL_BYTES: Final = 1 << 14
_UNREAD: Final = "not read, nor whether the log was ended: canmon stats does"


@dataclass(frozen=True, slots=True)
class _LogHead:
    """The beginning of a log, and its end if that can be found without a scan.

    Attributes:
        kind: format of the log.
        compressed: whether the log is compressed with gzip.
        size_bytes: size of the file.
        head_frames: number of frames read from the beginning of the log.
        channels: names of the buses in these frames.
        first_us: time of the first frame, or None if there is no frame.
        last_us: time of the last frame, or None if only a scan would find it.
        tally: counts of items at the beginning that are not frames.
    """

    kind: log_file.LogFormat
    compressed: bool
    size_bytes: int
    head_frames: int
    channels: tuple[str, ...]
    first_us: int | None
    last_us: int | None
    tally: LogTally

    @property
    def whole(self) -> bool:
        """Whether all of the log was read."""
        return self.head_frames < _HEAD_FRAMES

    @property
    def end_read(self) -> bool:
        """Whether the end of the log, or all of it, was read."""
        return self.whole or self.last_us is not None


_TEXT: Final = (LogFormat.CANDUMP, LogFormat.JSONL, LogFormat.CSV, LogFormat.GVRET)
"""Formats of lines that `LogLines` reads."""


def read_head(path: Path) -> _LogHead:
    """Read the first thousand frames of a log, and the end of a text log, for `canmon info`.

    Raises:
        LogFormatError: the name of the file indicates no format.
        OSError: the file cannot be read.
        LogError: the content does not match the name of the file.
    """
    kind, compressed = log_file.log_format(path), path.suffix.lower() == log_file.COMPRESSED
    reader = read_log(path)
    head = list(islice(reader, _HEAD_FRAMES))
    whole = len(head) < _HEAD_FRAMES
    last_us = head[-1].at_us if whole and head else None
    if not whole and kind in _TEXT and not compressed:
        last_us = None if reader.tally.shifted_us else _last_us(path)
    if kind is log_file.LogFormat.CSV and reader.tally.without_errors:
        kind = log_file.LogFormat.GVRET
    return _LogHead(
        kind,
        compressed,
        path.stat().st_size,
        len(head),
        tuple(dict.fromkeys(record.channel for record in head)),
        head[0].at_us if head else None,
        last_us,
        reader.tally,
    )


def _last_us(path: Path) -> int | None:
    """Return the time of the last frame of a text log, if it is near the end of the log."""
    with path.open("rb") as file:
        file.seek(-min(_TAIL_BYTES, path.stat().st_size), os.SEEK_END)
        lines = LogLines()
        tail = lines.push(file.read()) + lines.finish()
    known = tail and not (lines.deltas or lines.tally.shifted_us)
    return tail[-1].at_us if known else None


@click.command()
@click.argument("log", nargs=-1, required=True, type=PATH)
@click.option("--jsonl", is_flag=True, help="Print one JSON object per file.")
def command(log: Sequence[Path], jsonl: bool) -> None:
    """Show what log files hold: format, size, buses, first and last time.

    Only the beginning of a file is read, and the end of a text file. `canmon stats` reads the whole
    file.

    \b
    canmon info run.log run.blf
    canmon info run.log --jsonl
    """  # noqa: D301 - click wants the backspace
    for path in log:
        head = _head(path)
        for word in head.tally.messages(str(path)):
            click.echo(word, err=True)
        click.echo(_json(path, head) if jsonl else "\n".join(_lines(path, head)))


def _head(path: Path) -> _LogHead:
    try:
        return read_head(path)
    except log_file.LogFormatError as error:
        raise Refused(str(error)) from None
    except log_file.LogError as error:
        raise SourceFailed(str(error)) from None
    except OSError as error:
        raise SourceFailed(f"{path}: {error.strerror or error}") from None


def _lines(path: Path, head: _LogHead) -> list[str]:
    more = "" if head.whole else " at least"
    lines = [
        str(path),
        f"  format   {head.kind}{', gzip' if head.compressed else ''}",
        f"  size     {head.size_bytes:,} bytes",
        f"  frames   {head.head_frames:,}{more}",
        f"  buses    {' '.join(head.channels) or '-'}",
        f"  first    {_time(head.first_us)}",
        f"  last     {_time(head.last_us) if head.end_read else _UNREAD}",
    ]
    if head.first_us is not None and head.last_us is not None:
        lines.append(f"  span     {(head.last_us - head.first_us) / 1e6:.6f} s")
    return lines


def _time(at_us: int | None) -> str:
    if at_us is None:
        return "-"
    seconds, micros = divmod(at_us, 1_000_000)
    try:
        date = f"{datetime.fromtimestamp(seconds, UTC):%Y-%m-%d %H:%M:%S} UTC"
    except (ValueError, OverflowError, OSError):
        date = "no date"
    return f"{seconds}.{micros:06d} ({date})"


def _json(path: Path, head: _LogHead) -> str:

    said = {
        "v": 1,
        "file": str(path),
        "format": head.kind.value,
        "gzip": head.compressed,
        "bytes": head.size_bytes,
        "frames": head.head_frames if head.whole else None,
        "channels": head.channels,
        "first": None if head.first_us is None else head.first_us / 1e6,
        "last": None if head.last_us is None else head.last_us / 1e6,
        "bad_lines": head.tally.bad_lines.count,
    }
    return json_text(said, compact=True)
