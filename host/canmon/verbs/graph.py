"""The verb `graph`: curves of signals, in the terminal and in files."""

from __future__ import annotations

import os
import re
import shutil
import sys
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any, Final

import click

from tickrig.host.canmon.model.graph.plot import render
from tickrig.host.canmon.model.graph.series import Collector, ObjectName, Series, View, parse_signal
from tickrig.host.canmon.output.graph_file import check_graph_path, write_graph
from tickrig.host.canmon.output.listening import follow, report, span_option, take_blocks
from tickrig.host.canmon.sources.source import BlockLog, block_log, open_source
from tickrig.host.canmon.verbs.decode_options import (
    decode_options,
    explained,
    make_decoder,
    strict_option,
)
from tickrig.host.cli.can_options import BusOptions, bus_options, fd_options
from tickrig.host.cli.messages import Refused, refusing
from tickrig.host.cli.options import PATH, time_option
from tickrig.host.cli.start import paint

_SIZE: Final = re.compile(r"([0-9]{2,4})x([0-9]{2,4})")
_RANGE: Final = re.compile(r"([1-9])=((?:(?!\.\.)[0-9.eE+-])++)\.\.([0-9.eE+-]+)")


@dataclass(frozen=True, slots=True, kw_only=True)
class _GraphRequest:
    """The options of the verb `graph`, read.

    Attributes:
        files: files to write.
        from_us: beginning of the view after the first sample, None for all.
        to_us: its end, likewise.
        at_us: what is read out, likewise.
        ranges: of axes.
        size: of a picture in pixels.
        window_us: what is shown of a bus.
        span_us: how long a bus is heard, None where it was not said.
    """

    files: tuple[Path, ...]
    from_us: int | None
    to_us: int | None
    at_us: int | None
    ranges: dict[int, tuple[float, float]]
    size: tuple[int, int]
    window_us: int
    span_us: int | None

    def view(self, series: Sequence[Series]) -> View:
        """Return the view that is asked for; Refused if nothing is in it."""
        whole = View.of(series)
        first_us = whole.from_us
        with refusing():
            return View(
                first_us + (self.from_us or 0),
                whole.to_us if self.to_us is None else first_us + self.to_us,
                self.ranges,
                None if self.at_us is None else first_us + self.at_us,
                first_us,
            )


def _checked_files(
    context: click.Context, parameter: click.Parameter, files: tuple[Path, ...]
) -> tuple[Path, ...]:
    for file in files:
        check_graph_path(file)
    return files


def _size(context: click.Context, parameter: click.Parameter, text: str) -> tuple[int, int]:
    match = _SIZE.fullmatch(text)
    if match is None:
        raise Refused(f"--size {text!r} is not WIDTHxHEIGHT in pixels, as 960x400")
    return int(match[1]), int(match[2])


def _range(text: str) -> tuple[int, tuple[float, float]]:
    match = _RANGE.fullmatch(text)
    try:
        if match is None:
            raise ValueError
        low, high = float(match[2]), float(match[3])
        if not low < high:
            raise ValueError
    except ValueError:
        raise Refused(f"--range {text!r} is not AXIS=LOW..HIGH, as 1=-5..5") from None
    return int(match[1]), (low, high)


_MOST: Final = 2_000_000
"""Samples of a signal that are kept of a bus."""

SIZE: Final = (100, 28)
"""Columns and lines where there is no terminal."""


@click.command()
@click.argument("source")
@click.argument("signals", nargs=-1, required=True, metavar="SIGNAL...")
@decode_options
@click.option(
    *("-o", "files"),
    multiple=True,
    type=PATH,
    callback=_checked_files,
    metavar="FILE",
    help=".svg .html .png .csv",
)
@time_option("--from", "from_us", help="Begin 3s after the first sample.")
@time_option("--to", "to_us", help="End 9s after the first sample.")
@time_option("--at", "at_us", help="Read out the values there.")
@click.option("--range", "ranges", multiple=True, metavar="AXIS=LOW..HIGH", help="As 1=-5..5.")
@click.option(
    "--size", metavar="WxH", default="960x400", callback=_size, help="Of a picture; 960x400 pixels."
)
@time_option("--window", "window_us", default="10s", help="Shown of a bus; 10s.")
@span_option
@strict_option
@bus_options
@fd_options
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
    options["ranges"] = dict(map(_range, options["ranges"]))
    request = _GraphRequest(**{one.name: options.pop(one.name) for one in fields(_GraphRequest)})
    with refusing():
        words = [parse_signal(text) for text in signals]
    eds, dbc, strict = (options.pop(name) for name in ("eds", "dbc", "strict"))
    objects = any(isinstance(word.source, ObjectName) for word in words)
    decoder = make_decoder(eds, dbc) if objects or eds or dbc else None
    log = None if objects else block_log([source])
    collector = Collector(words)
    whole = log is not None and take_blocks(log, collector.take_columns)
    frames = (log if whole else None) or open_source([source], BusOptions(**options))
    with closing(frames):
        if not isinstance(frames, BlockLog):
            collector = Collector(words, decoder, _MOST if frames.live else 0)
            lines = partial(_live, collector.series, request)
            follow(frames, [source], collector.take_all, request.span_us, lines)
        _show(collector.series, request)
    report(frames, strict)


def _live(
    series: Sequence[Series], request: _GraphRequest, now_us: int, width: int, height: int
) -> list[str]:
    view = View(now_us - max(1, request.window_us), now_us, request.ranges, None, now_us)
    return render(series, view, width, height, colour="NO_COLOR" not in os.environ)


def _show(series: Sequence[Series], request: _GraphRequest) -> None:
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
        show = partial(paint, sys.stdout) if colour else click.echo
        show("\n".join(line.rstrip() for line in lines) + "\n" * colour)


explained(command)
