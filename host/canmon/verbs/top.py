"""The verb `top`: a table of all identifiers."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tickrig.host.canmon.errors import until_unread
from tickrig.host.canmon.output.ending import report, until_interrupted
from tickrig.host.canmon.output.filtered_decoder import FilteredDecoder
from tickrig.host.canmon.output.listening import (
    bit_rate_of,
    listen,
    paint,
    patience_us,
    span_option,
)
from tickrig.host.canmon.sources.source import explain_sources, open_any
from tickrig.host.canmon.sources.whole_log import whole_log
from tickrig.host.canmon.verbs.decode_options import (
    decode_options,
    filter_option,
    make_decoder,
    read_filter,
)
from tickrig.host.cli.can_options import BusCommand, BusOptions, bus_options
from tickrig.host.monitor.views.top_model import TopModel

if TYPE_CHECKING:
    from tickrig.host.monitor.frames.record import AnyRecord

Take = Callable[["Sequence[AnyRecord]"], None]


@click.command(cls=BusCommand)
@click.argument("source", nargs=-1)
@click.option("-d", "--decode", is_flag=True, help="Show what frames mean instead of bytes.")
@filter_option
@decode_options
@span_option
@click.option("--strict", is_flag=True, help="Exit status 4 if frames were lost or bad.")
@bus_options
def command(  # noqa: PLR0913 - options
    *,
    source: Sequence[str],
    decode: bool,
    wanted: str | None,
    eds: Sequence[str],
    dbc: Sequence[Path],
    span_us: int | None,
    strict: bool,
    **options: Any,
) -> None:
    """Show all identifiers: counts, rates, gaps, jitter, missed cycles, changes, load.

    It listens only. Ten times a second the screen is painted; the last table
    stays in the terminal. A log file is read at once. The load is a share of
    the bit rate that -b gives.

    \b
    canmon top can0 -b 500000
    canmon top run.log
    canmon top can0 -d --eds 3=drive.eds -F 'node=3 and pdo'
    ssh robot canmon dump can0 --jsonl | canmon top -
    canmon top can0 --for 10s > table.txt

    Keys: q quit, space hold, b bits, d decode (with -d, -F, --eds or --dbc),
    n notch (hide what changed so far), s sort, c clear, arrows scroll.

    {source}
    """  # noqa: D301 - click wants the backspace
    bus = BusOptions(**options)
    chosen, model = read_filter(wanted), TopModel(bit_rate_of(source, bus))
    plain = not (decode or chosen or eds or dbc)
    meaning = FilteredDecoder(None if plain else make_decoder(eds, dbc), chosen)
    take = model.take if plain else _take_decoded(model, meaning)
    log = whole_log(source) if plain else None
    model.press("d" if decode else "")
    frames = log or open_any(source, bus)
    on_screen = frames.live and sys.stdout.isatty()
    try:
        with until_interrupted():
            if on_screen:
                paint(
                    frames,
                    take,
                    lambda at_us, width, height: model.lines(
                        at_us, frames.lost, width, height, frames.unread
                    ),
                    span_us,
                    model.press,
                )
            else:
                listen(frames, take, span_us or patience_us(frames, source))
        with until_unread():
            click.echo("\n".join(model.final(frames.lost, log.snapshot() if log else None)))
    finally:
        frames.close()
    report(frames, strict, meaning.messages())


def _take_decoded(model: TopModel, meaning: FilteredDecoder) -> Take:
    return lambda records: model.take_decoded(meaning.take(records))


explain_sources(command)
