"""The verb `top`, which shows a table of all identifiers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tickrig.host.canmon.model.top_model import TopModel
from tickrig.host.canmon.output import listening
from tickrig.host.canmon.output.printer import FilteredDecoder
from tickrig.host.canmon.sources.source import BlockLog, LogCut, block_log, is_live, open_any
from tickrig.host.canmon.verbs import decode_options
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import until_unread
from tickrig.host.cli.options import refuse_idle

if TYPE_CHECKING:
    from tickrig.host.canmon.model.frames import AnyRecord

_Take = Callable[["Sequence[AnyRecord]"], None]


@decode_options.source_command(
    click.option("-d", "--decode", is_flag=True, help="Show what frames mean instead of bytes."),
    decode_options.filter_option,
    decode_options.decode_options,
    listening.span_option,
    decode_options.cut_options,
    decode_options.reopen_option,
)
def command(  # noqa: PLR0913 - options
    *,
    source: Sequence[str],
    decode: bool,
    wanted: str | None,
    eds: decode_options.EdsOptions,
    dbc: Sequence[Path],
    span_us: int | None,
    cut: LogCut,
    reopen: bool,
    strict: bool,
    **options: Any,
) -> None:
    """Show all identifiers: counts, rates, gaps, jitter, missed cycles, changes, load.

    The command only listens. The screen is updated ten times a second, and the last table stays in
    the terminal. A log file is read at once. The load is a share of the bit rate that -b gives.

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
    chosen = decode_options.read_filter(wanted)
    model = TopModel(listening.bit_rates_of(source, bus))
    plain = not (decode or chosen or eds or dbc)
    meaning = FilteredDecoder(None if plain else decode_options.make_decoder(eds, dbc), chosen)
    take: _Take = model.take
    if not plain:
        take = lambda records: model.take_decoded(meaning.take(records))  # noqa: E731
    cut = meaning.learning(cut)
    if not decode and wanted is None and source and not any(map(is_live, source)):
        refuse_idle("only -d and -F decode frames", "eds", "eds_folders", "dbc")
    log = block_log(source, cut) if plain else None
    snapshot = listening.count_blocks(log, span_us)
    model.press("d" if decode else "")
    frames = (log if snapshot else None) or open_any(source, bus, cut)
    if reopen:
        frames.reopen()

    def lines(at_us: int, width: int, height: int) -> list[str]:
        shown = model.lines(at_us, frames.lost, width, height, frames.unread)
        if away := frames.away:
            shown[0] = f"GONE: {', '.join(away)}  {shown[0]}"[:width]
        return shown

    with closing(frames):
        if not isinstance(frames, BlockLog):
            listening.follow(frames, source, take, span_us, lines, press=model.press)
        with until_unread():
            click.echo("\n".join(model.final(frames.lost, snapshot)))
    listening.report(frames, strict, meaning.messages())
    listening.expect_frames(frames, meaning)
