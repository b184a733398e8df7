"""The verb `graph`: curves of signals, in the terminal and in files."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Sequence
from typing import Any, Final

import click

from tickrig.host.canmon.output.ending import report, until_interrupted
from tickrig.host.canmon.output.graph_file import write_graph
from tickrig.host.canmon.output.listening import listen, patience_us, span_option
from tickrig.host.canmon.output.painting import paint
from tickrig.host.canmon.sources.source import Source, explain_sources, open_source
from tickrig.host.canmon.sources.whole_log import WholeLog, whole_log
from tickrig.host.canmon.verbs.decode_options import decode_options, make_decoder
from tickrig.host.canmon.verbs.graph_request import GraphRequest
from tickrig.host.cli.can_options import BusOptions, bus_options
from tickrig.host.cli.options import PATH
from tickrig.host.cli.refused import Refused
from tickrig.host.monitor.graph.collector import Collector
from tickrig.host.monitor.graph.drawing.plot import render
from tickrig.host.monitor.graph.series import Series
from tickrig.host.monitor.graph.signal_word import ObjectName, parse_signal
from tickrig.host.monitor.graph.view import View

MOST: Final = 2_000_000
"""Samples of a signal that are kept of a bus."""

SIZE: Final = (100, 28)
"""Columns and lines where there is no terminal."""


@click.command()
@click.argument("source")
@click.argument("signals", nargs=-1, required=True, metavar="SIGNAL...")
@decode_options
@click.option("-o", "files", multiple=True, type=PATH, metavar="FILE", help=".svg .html .png .csv")
@click.option("--from", "from_", metavar="TIME", help="Begin 3s after the first sample.")
@click.option("--to", metavar="TIME", help="End 9s after the first sample.")
@click.option("--at", metavar="TIME", help="Read out the values there.")
@click.option("--range", "ranges", multiple=True, metavar="AXIS=LOW..HIGH", help="As 1=-5..5.")
@click.option("--size", metavar="WxH", default="960x400", help="Of a picture; 960x400 pixels.")
@click.option("--window", metavar="TIME", default="10s", help="Shown of a bus; 10s.")
@span_option
@click.option("--strict", is_flag=True, help="Exit status 4 if frames were lost or bad.")
@bus_options
def command(source: str, signals: Sequence[str], **options: Any) -> None:
    """Draw curves of SOURCE: in the terminal, or to files.

    A SIGNAL is an object, as 3.velocity_actual_value or 3.statusword.fault
    (names of the EDS or DBC file, or of what SDO traffic told), or a slice, as
    ID[BYTES]TYPE*FACTOR+OFFSET: BYTES is 2, 2:6, bit 2.3 or bits 2.3+5; TYPE
    is u, s or f, with b behind it big-endian. LABEL= before it names it, @2
    behind it takes another axis. A spike never vanishes: each column shows its
    least and greatest value.

    \b
    canmon graph run.log '181[2:6]s*0.001'
    canmon graph run.blf 'speed=181[2:6]s*0.001' '281[0:2]@2' -o g.svg -o g.csv
    canmon graph can0 3.velocity_actual_value --eds 3=drive.eds --window 5s

    A bus is drawn live; q or Ctrl-C ends that.

    {source}
    """  # noqa: D301 - click wants the backspace
    request = GraphRequest.of(options)
    try:
        words = [parse_signal(text) for text in signals]
    except ValueError as error:
        raise Refused(str(error)) from None
    eds, dbc, strict = (options.pop(name) for name in ("eds", "dbc", "strict"))
    objects = any(isinstance(word.source, ObjectName) for word in words)
    decoder = make_decoder(eds, dbc) if objects or eds or dbc else None
    whole = None if objects else whole_log([source])
    frames = whole or open_source([source], BusOptions(**options))
    collector = Collector(words, decoder, MOST if frames.live else 0)
    try:
        with until_interrupted():
            _collect(frames, source, collector, request)
        _show(collector.series, request)
    finally:
        frames.close()
    report(frames, strict)


def _collect(
    frames: Source | WholeLog, source: str, collector: Collector, request: GraphRequest
) -> None:
    """Take what comes; live, paint it where there is a terminal."""
    if isinstance(frames, WholeLog):
        collector.take_columns(frames.columns)
    elif frames.live and sys.stdout.isatty():
        paint(
            frames,
            collector.take_all,
            lambda *at: _live(collector.series, request, *at),
            request.span_us,
        )
    else:
        listen(frames, collector.take_all, request.span_us or patience_us(frames, [source]))


def _live(
    series: Sequence[Series], request: GraphRequest, now_us: int, width: int, height: int
) -> list[str]:
    view = View(now_us - request.window_us, now_us, request.ranges, None, now_us)
    return render(series, view, width, height, colour="NO_COLOR" not in os.environ)


def _show(series: Sequence[Series], request: GraphRequest) -> None:
    """Write the files, else print the picture; say what has no samples."""
    for one in series:
        if not one:
            click.echo(f"{one.label}: no samples", err=True)
        if one.not_numbers:
            click.echo(f"{one.label}: {one.not_numbers} samples are no numbers", err=True)
    view = request.view(series)
    for file in request.files:
        write_graph(file, series, view, request.size)
    if not request.files:
        width, height = shutil.get_terminal_size(SIZE)
        colour = sys.stdout.isatty() and "NO_COLOR" not in os.environ
        lines = render(series, view, width, min(height - 1, SIZE[1]), colour=colour)
        click.echo("\n".join(line.rstrip() for line in lines))


explain_sources(command)
