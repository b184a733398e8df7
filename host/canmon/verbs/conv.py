"""The verb `conv`: log files into another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tickrig._lazy import LazyModule
from tickrig.host.canmon.model.recorder.files import RecordingPlan
from tickrig.host.canmon.output.listening import report, until_interrupted
from tickrig.host.canmon.output.printer import DecodedFrame, FilteredDecoder
from tickrig.host.canmon.output.recording import LogFile, whole_log
from tickrig.host.canmon.sources.source import PieceLog, open_source, piece_log
from tickrig.host.canmon.verbs import decode_options
from tickrig.host.canmon.verbs.dump import pass_on
from tickrig.host.cli.options import PATH
from tickrig.host.cli.start import INTERRUPTED

if TYPE_CHECKING:
    from tickrig.host.canmon.model.columns import column_text
    from tickrig.host.canmon.model.columns import columns as column_blocks
    from tickrig.host.canmon.model.logs.log_file import Mark
    from tickrig.host.canmon.model.logs.log_writer import TextBlock
else:  # numpy
    column_text = LazyModule("tickrig.host.canmon.model.columns.column_text")
    column_blocks = LazyModule("tickrig.host.canmon.model.columns.columns")


@click.command()
@click.argument("source", nargs=-1, required=True)
@click.argument("log", type=PATH)
@decode_options.filter_option
@decode_options.decode_options
@decode_options.strict_option
def command(  # noqa: PLR0913 - options
    *,
    source: Sequence[str],
    log: Path,
    wanted: str | None,
    eds: Sequence[str],
    dbc: Sequence[Path],
    strict: bool,
) -> None:
    """Write what SOURCE holds into the file LOG; its name says the format.

    Several files are merged by time. What a format cannot hold is said on
    standard error. Of files LOG is written whole, or stays as it was.

    \b
    canmon conv a.blf b.log
    canmon conv left.log right.asc.gz both.log
    canmon conv run.log,123:7FF run.csv
    canmon conv run.log faults.log -F 'emcy or error'

    {source}
    """  # noqa: D301 - click wants the backspace
    chosen = decode_options.read_filter(wanted)
    decoder = None if chosen is None else decode_options.make_decoder(eds, dbc)
    meaning, pieces = (
        FilteredDecoder(decoder, chosen),
        piece_log(source) if chosen is None else None,
    )
    frames = pieces or open_source(source)
    with closing(frames), whole_log(log, source) as place:
        with (
            closing(LogFile(RecordingPlan(path=place), source, kept=place == log)) as out,
            until_interrupted() as signals,
        ):
            if pieces is None:
                pass_on(frames, meaning, signals.behind(out.take))
            else:
                _pass_pieces(pieces, signals.behind(out.take), signals.behind(out.take_block))
        if signals.came and place != log:
            raise click.exceptions.Exit(INTERRUPTED)
    report(frames, strict, meaning.messages())


def _pass_pieces(
    log: PieceLog,
    take: Callable[[list[DecodedFrame], int, Sequence[Mark]], bool],
    take_block: Callable[[TextBlock], bool],
) -> None:
    """Pass a large log on, of which all frames are wanted."""
    for piece in log.pieces():
        if isinstance(piece, Sequence):
            take([(record, None) for record in piece], log.lost, log.marks)
        elif len(piece) and not (
            column_text.fits(piece) and take_block(column_text.ColumnText(piece))
        ):
            take([(record, None) for record in column_blocks.records(piece)], log.lost, log.marks)


decode_options.explained(command)
