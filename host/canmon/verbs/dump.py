"""The verb `dump`: frames as they come, one line each."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig.host.canmon.errors import until_unread
from tickrig.host.canmon.output.filtered_decoder import DecodedFrame, FilteredDecoder
from tickrig.host.canmon.output.listening import report, say_marks, until_interrupted
from tickrig.host.canmon.output.log_file import LogFile
from tickrig.host.canmon.output.printer import Output, StdoutWriter, printer_of
from tickrig.host.canmon.sources.opening import open_any
from tickrig.host.canmon.sources.source import AnySource
from tickrig.host.canmon.sources.source_spec import LineSpec, parse_source
from tickrig.host.canmon.verbs.decode_options import (
    decode_options,
    filter_option,
    make_decoder,
    read_filter,
)
from tickrig.host.canmon.verbs.source_command import reopen_option, source_command
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.options import PATH, add_options
from tickrig.host.cli.refused import Refused
from tickrig.host.monitor.frames.dump_line import Stamp

if TYPE_CHECKING:
    from tickrig.host.monitor.frames.record import AnyRecord
    from tickrig.host.monitor.logs.mark import Mark

POLL_US: Final = 100_000

Take = Callable[[list[DecodedFrame], int, "Sequence[Mark]"], None]
"""Takes frames, how many were lost so far, and what happened behind them."""

_shown: Final = add_options(
    click.option(
        "-t",
        "stamp",
        type=click.Choice([stamp.value for stamp in Stamp if stamp]),
        help="Time: (a)bsolute, (d)elta, (z)ero at the first, (A)bsolute with date.",
    ),
    click.option("-x", "extra", is_flag=True, help="Show RX or TX."),
    click.option("-e", "errors", is_flag=True, help="Error frames in words, with --raw too."),
    click.option("-r", "--raw", is_flag=True, help="Bytes alone, as candump shows them."),
    click.option("-L", "output", flag_value="log", help="Lines of a log, as candump -L."),
    click.option("--jsonl", "output", flag_value="jsonl", help="One JSON object a line."),
    click.option("--csv", "output", flag_value="csv", help="Rows with a header."),
    click.option(
        "-l", "file", type=PATH, metavar="FILE", help="Into a log, as run.blf; nothing is shown."
    ),
)
_ending: Final = add_options(
    reopen_option,
    click.option("-n", "count", type=click.IntRange(1), metavar="N", help="End after N frames."),
    click.option(
        "-T", "quiet_ms", type=click.IntRange(1), metavar="MS", help="End after MS without a frame."
    ),
)


@source_command(
    _shown,
    filter_option,
    decode_options,
    _ending,
)
def command(  # noqa: PLR0913 - options
    *,
    source: Sequence[str],
    stamp: str | None,
    extra: bool,
    errors: bool,
    raw: bool,
    output: str | None,
    file: Path | None,
    wanted: str | None,
    eds: Sequence[str],
    dbc: Sequence[Path],
    count: int | None,
    quiet_ms: int | None,
    reopen: bool,
    strict: bool,
    **options: Any,
) -> None:
    """Show frames as they come, and what they mean.

    It listens only. What frames mean is told by the CANopen standard, by
    --eds and --dbc, and by the SDO traffic that is heard. Frames are on
    standard output; what was lost or is no frame is said on standard error.

    \b
    canmon dump can0 -t z
    canmon dump can0 --eds 3=drive.eds -F 'node=3 and (pdo or emcy)'
    canmon dump can0 -l run.blf
    canmon dump run.asc.gz -L > run.log
    ssh robot canmon dump can0 --jsonl | canmon top -

    {source}
    """  # noqa: D301 - click wants the backspace
    if file is not None and output:
        raise Refused("-l shows nothing: it goes without -L, --jsonl and --csv")
    if (file is not None or output == Output.LOG) and any(map(_is_line, source)):
        raise Refused(
            "a log holds frames alone: a serial port is shown, or goes into --jsonl, --csv"
        )
    chosen, form = read_filter(wanted), Output(output or "")
    plain = raw or form is Output.LOG or file is not None
    decoder = None if plain and chosen is None else make_decoder(eds, dbc)
    meaning = FilteredDecoder(decoder, chosen)
    shown = StdoutWriter(printer_of(form, Stamp(stamp or ""), extra, plain, errors), form)
    with ExitStack() as held:
        frames = held.enter_context(closing(open_any(source, BusOptions(**options))))
        if reopen:
            frames.reopen()
        log = None if file is None else held.enter_context(closing(LogFile(file, source)))
        with until_interrupted(), until_unread():
            pass_on(frames, meaning, (log or shown).take, count, quiet_ms)
    report(frames, strict, meaning.messages())


def _is_line(word: str) -> bool:
    return isinstance(parse_source(word), LineSpec)


def pass_on(
    source: AnySource[AnyRecord],
    meaning: FilteredDecoder,
    take: Take,
    count: int | None = None,
    quiet_ms: int | None = None,
) -> None:
    """Pass frames on until the source ends, `count` of them came, or none for `quiet_ms`."""
    quiet_s = quiet_ms / 1e3 if quiet_ms else float("inf")
    latest_s, left = time.monotonic(), count
    while not source.ended and left != 0:
        records = source.poll(min(POLL_US, (quiet_ms or POLL_US) * 1_000))
        decoded_frames = list(islice(meaning.take(records), left))
        take(decoded_frames, source.lost, source.marks)
        say_marks(source)
        left = None if left is None else left - len(decoded_frames)
        if records:
            latest_s = time.monotonic()
        elif time.monotonic() - latest_s >= quiet_s:
            break
