"""The verb `info`: what a log is, from its head alone."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import click

from tickrig.host.canmon.output.failure import SourceFailed
from tickrig.host.cli.options import PATH
from tickrig.host.cli.refused import Refused
from tickrig.host.monitor.logs.log_format import LogFormatError
from tickrig.host.monitor.logs.reading.log_head import LogHead, read_head
from tickrig.host.monitor.logs.reading.log_reader import LogError


@click.command()
@click.argument("log", nargs=-1, required=True, type=PATH)
@click.option("--jsonl", is_flag=True, help="One JSON object a file.")
def command(log: Sequence[Path], jsonl: bool) -> None:
    """Say what log files are: format, size, buses, first and last time.

    The beginning of a file is read, and the end of one in text; nothing is
    scanned. `canmon stats` reads all of it.

    \b
    canmon info run.log run.blf
    canmon info run.log --jsonl
    """  # noqa: D301 - click wants the backspace
    for path in log:
        head = _head(path)
        for word in head.tally.words(str(path)):
            click.echo(word, err=True)
        click.echo(_json(path, head) if jsonl else "\n".join(_lines(path, head)))


def _head(path: Path) -> LogHead:
    try:
        return read_head(path)
    except LogFormatError as error:
        raise Refused(str(error)) from None
    except LogError as error:
        raise SourceFailed(str(error)) from None
    except OSError as error:
        raise SourceFailed(f"{path}: {error.strerror or error}") from None


def _lines(path: Path, head: LogHead) -> list[str]:
    more = "" if head.whole else " at least"
    lines = [
        str(path),
        f"  format   {head.kind}{', gzip' if head.compressed else ''}",
        f"  size     {head.size_bytes:,} bytes",
        f"  frames   {head.head_frames:,}{more}",
        f"  buses    {' '.join(head.channels) or '-'}",
        f"  first    {_time(head.first_us)}",
        f"  last     {_time(head.last_us)}",
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


def _json(path: Path, head: LogHead) -> str:
    import json  # noqa: PLC0415 - seldom wanted

    said = {
        "v": 1,
        "file": str(path),
        "format": head.kind.value,
        "gzip": head.compressed,
        "bytes": head.size_bytes,
        "frames": head.frames,
        "channels": head.channels,
        "first": None if head.first_us is None else head.first_us / 1e6,
        "last": None if head.last_us is None else head.last_us / 1e6,
        "bad_lines": head.tally.bad_lines.count,
    }
    return json.dumps(said, separators=(",", ":"))
