"""The verb `graph`, which draws curves of signals in the terminal and in files."""

from __future__ import annotations

import os
import re
import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig._lazy import LazyModule
from tickrig.host.canmon.model.frames import (
    DATED_US,
    REMOTE,
    LogTime,
    Record,
    date_text,
    ident_text,
    rate_text,
)
from tickrig.host.canmon.model.graph.plot import render
from tickrig.host.canmon.model.graph.series import (
    BUS_SIGNALS,
    OF_NODES,
    Collector,
    FrameSlice,
    Series,
    View,
    parse_signal,
)
from tickrig.host.canmon.model.survey import SignalName, SignalTrack, Survey
from tickrig.host.canmon.output.graph_file import check_graph_path, write_graph
from tickrig.host.canmon.output.listening import (
    bit_rates_of,
    follow,
    report,
    span_option,
    take_blocks,
)
from tickrig.host.canmon.sources.source import BlockLog, block_log, is_live, open_source
from tickrig.host.canmon.verbs.decode_options import (
    decode_options,
    explained,
    log_time_option,
    make_decoder,
    refuse_idle_of_bus,
    strict_option,
)
from tickrig.host.cli.can_options import BusOptions, bus_options, fd_options
from tickrig.host.cli.messages import Refused, refusing
from tickrig.host.cli.options import PATH, refuse_idle, time_option
from tickrig.host.cli.start import paint
from tickrig.host.text.names import closest
from tickrig.host.text.page_text import one_line

if TYPE_CHECKING:
    from tickrig.host.canmon.model.columns import column_survey
    from tickrig.host.canmon.model.decode.decoder import Decoder
else:  # numpy
    column_survey = LazyModule("tickrig.host.canmon.model.columns.column_survey")

_SIZE: Final = re.compile(r"([0-9]{2,4})x([0-9]{2,4})")
_RANGE: Final = re.compile(r"([1-9])=((?:(?!\.\.)[0-9.eE+-])++)\.\.([0-9.eE+-]+)")


@dataclass(frozen=True, slots=True, kw_only=True)
class _GraphRequest:
    """The parsed options of the verb `graph`.

    Attributes:
        files: files to write.
        begin: start of the view, or None for all.
        end: end of the view, or None for all.
        at: time of the cursor, or None for none.
        ranges: ranges of axes.
        size: size of a picture in pixels.
        window_us: length of the window of a bus.
        span_us: time to listen to a bus, or None if no time is given.
        title: title of a picture.
    """

    files: tuple[Path, ...]
    begin: LogTime | None
    end: LogTime | None
    at: LogTime | None
    ranges: dict[int, tuple[float, float]]
    size: tuple[int, int]
    window_us: int
    span_us: int | None
    title: str

    def view(self, series: Sequence[Series], first_us: int | None) -> View:
        """Return the part of the curves to draw.

        Raise Refused if the options of the command that select this part are invalid.

        Args:
            series: samples of each curve.
            first_us: time of the first frame, from which times count.
        """
        whole = View.of(series)
        origin_us = whole.from_us if first_us is None else first_us
        to_us = whole.to_us if self.end is None else self.end.after(origin_us)
        from_us = min(whole.from_us, to_us - 1)
        if self.begin is not None:
            from_us = self.begin.after(origin_us)
            to_us = max(to_us, from_us + 1) if self.end is None else to_us
        with refusing():
            at_us = None if self.at is None else self.at.after(origin_us)
            return View(from_us, to_us, self.ranges, at_us, origin_us)


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
    with suppress(ValueError):
        if match is not None:
            low, high = float(match[2]), float(match[3])
            if low < high:
                return int(match[1]), (low, high)
    raise Refused(f"--range {text!r} is not AXIS=LOW..HIGH, as 1=-5..5")


_MOST: Final = 2_000_000
"""Number of samples that are kept of a signal of a bus."""

_NO_TERMINAL: Final = (100, 28)
"""Columns and lines that are used without a terminal."""


@click.command()
@click.argument("source")
@click.argument("signals", nargs=-1, metavar="[SIGNAL]...")
@decode_options
@click.option(
    *("-o", "files"),
    multiple=True,
    type=PATH,
    callback=_checked_files,
    metavar="FILE",
    help="Write a .svg, .html, .png or .csv file.",
)
@click.option("--title", default="", metavar="TEXT", help="Title of the picture.")
@log_time_option(
    "--from",
    "begin",
    help="Begin at TIME in a log, such as 2.5 (s after the first frame) or a date.",
)
@log_time_option("--to", "end", help="End at TIME, written as for --from.")
@log_time_option("--at", "at", help="Print the values at TIME, written as for --from.")
@click.option(
    "--range",
    "ranges",
    multiple=True,
    metavar="AXIS=LOW..HIGH",
    help="Range of an axis, such as 1=-5..5.",
)
@click.option(
    "--size",
    metavar="WxH",
    default="960x400",
    callback=_size,
    help="Size of the picture in pixels.  [960x400]",
)
@time_option("--window", "window_us", default="10s", help="Time span to show of a bus.  [10s]")
@span_option
@strict_option
@bus_options
@fd_options
def command(source: str, signals: Sequence[str], **options: Any) -> None:
    """Draw curves of SOURCE: in the terminal, or to files. Without SIGNAL, list all signals.

    A SIGNAL is an object, such as 3.velocity_actual_value or 3.statusword.fault (names from the EDS
    or DBC file, or from SDO traffic), or a slice, such as ID[BYTES]TYPE*FACTOR+OFFSET. BYTES is 2,
    2:6, bit 2.3 or bits 2.3+5. TYPE is u, s or f, with the suffix b for big-endian. The prefix
    LABEL= names the curve, and the suffix @2 puts it on another axis. A spike never vanishes,
    because each column shows its smallest and largest value. load, nmt, emcy, sdo and 'sync jitter'
    are curves or states of the bus and its nodes, such as 3.nmt. A statusword is shown as its
    states.

    \b
    canmon graph run.log --eds 3=drive.eds
    canmon graph run.log 3.velocity_actual_value 3.statusword 3.emcy load
    canmon graph run.log '181[2:6]s*0.001'
    canmon graph run.blf 'speed=181[2:6]s*0.001' '281[0:2]@2' -o g.svg -o g.csv
    canmon graph can0 3.velocity_actual_value --eds 3=drive.eds --window 5s

    A bus is drawn live, until q or Ctrl-C.

    {source}
    """  # noqa: D301 - click wants the backspace
    options["ranges"] = dict(map(_range, options["ranges"]))
    request = _GraphRequest(**{one.name: options.pop(one.name) for one in fields(_GraphRequest)})
    with refusing():
        words = [parse_signal(text) for text in signals]
    eds, dbc, strict = (options.pop(name) for name in ("eds", "dbc", "strict"))
    bus = BusOptions(**options)
    refuse_idle_of_bus([source])
    slices = all(isinstance(word.source, FrameSlice) for word in words)
    if words and slices:
        refuse_idle("slices have no names", "eds", "eds_folders", "dbc")
    _refuse_idle(source, request, listed=not words)
    if not words:
        _list(source, make_decoder(eds, dbc), bus, request, strict=strict)
        return
    rates = bit_rates_of([source], bus)
    decoder = None if slices else make_decoder(eds, dbc)
    log = block_log([source]) if slices else None
    collector = Collector(words)
    whole = log is not None and take_blocks(log, collector.take_columns, request.span_us)
    frames = (log if whole else None) or open_source([source], bus)
    with closing(frames):
        if not isinstance(frames, BlockLog):
            most = _MOST if frames.live else 0
            collector = Collector(words, decoder, most, rates, each_node=True)
            lines = partial(_live, collector.series, request)
            follow(frames, [source], collector.take_all, request.span_us, lines)
        if not frames.live and not frames.failed:
            _refuse_missing(source, collector)
        shown = _show(source, collector, request)
    report(frames, strict)
    if not shown and (frames.recorded or not frames.live):
        raise click.exceptions.Exit(_NOTHING_SHOWN)


_OF_PICTURES: Final = ("title", "size", "ranges", "at")
_OF_VIEWS: Final = (*_OF_PICTURES, "files", "begin", "end", "window_us")


def _refuse_idle(source: str, request: _GraphRequest, *, listed: bool) -> None:
    """Raise Refused for options without an effect."""
    if listed:
        refuse_idle("without a SIGNAL the signals are listed", *_OF_VIEWS)
    if not request.files:
        refuse_idle("it is for a picture: give -o FILE", "title", "size")
    elif all(file.suffix.lower() == ".csv" for file in request.files):
        refuse_idle("a CSV is not a picture", *_OF_PICTURES)
    if not is_live(source):
        refuse_idle("it is for a bus; for a log use --from and --to", "window_us")


def _refuse_missing(source: str, collector: Collector) -> None:
    """Raise Refused for objects that a log does not hold. The message suggests similar names."""
    for text in collector.missing:
        node, dot, base = text.lower().rpartition(".") if text[:1].isdecimal() else ("", "", text)
        of_node = [f"{node}{dot}{kind}" for kind in BUS_SIGNALS if not dot or kind in OF_NODES]
        names = [*collector.object_names, *of_node]
        meant = closest(text, names) or [name for name in names if base in name.lower()]
        hint = f"did you mean {meant[0]!r}?" if meant else f"canmon graph {source} lists what is"
        raise Refused(f"{text!r}: no such signal in {source}; {hint}")


def _list(
    source: str, decoder: Decoder, bus: BusOptions, request: _GraphRequest, *, strict: bool
) -> None:
    """List the signals of a source."""
    survey, log = Survey(decoder), block_log([source])
    whole = (
        log is not None
        and decoder.standard
        and take_blocks(log, column_survey.ColumnSurvey(decoder, survey).take, request.span_us)
    )
    frames = (log if whole else None) or open_source([source], bus)
    with closing(frames):
        if not isinstance(frames, BlockLog):

            def take(records: Sequence[Record]) -> None:
                for record in records:
                    survey.follow(record)

            follow(frames, [source], take, request.span_us)
        click.echo("\n".join(_tree(survey)))
    report(frames, strict)


def _tree(survey: Survey) -> Iterator[str]:
    """Yield the signals as lines, for each node by PDO, and then for the bus."""
    span_us = max(1, survey.since(survey.last_us))
    several = len(survey.frames) > 1
    width = max((len(_written(name)) for name in survey.signals), default=0)
    nodes: dict[tuple[str, int | None], str] = {
        (row.channel, row.node): row.name for row in survey.rows() if row.present
    }
    groups = {(name.channel, name.node) for name in survey.signals} | set(nodes)
    for channel, node in sorted(groups, key=lambda key: (key[0], key[1] or 0)):
        place = "other signals" if node is None else f"node {node}"
        bus = f"{channel} " if several else ""
        yield one_line(f"{bus}{place}  {nodes.get((channel, node), '')}".rstrip())
        for name, track in sorted(survey.signals.items(), key=lambda one: _number(one[0].kind)):
            if (name.channel, name.node) == (channel, node):
                rate = f"{rate_text(track.count * 1e6 / span_us)}/s"
                yield one_line(
                    f"  {_written(name):<{width}}  {name.kind:<6} {rate:>10}  {_values(track)}"
                )
        if node is not None:
            yield "".join(f"  {node}.{kind}" for kind in OF_NODES)
    bare = sorted({ident_text(ident) for _, ident in survey.counts.sums if not ident & REMOTE})
    yield "bus"
    yield "  load  sync jitter"
    if bare:
        yield f"  bytes of frames, as {bare[0]}[0:2]: {' '.join(bare)}"


def _number(kind: str) -> tuple[str, int]:
    return kind.rstrip("0123456789"), int(kind.lstrip("abcdefghijklmnopqrstuvwxyz") or 0)


def _written(name: SignalName) -> str:
    return name.name if name.node is None else f"{name.node}.{name.name}"


def _values(track: SignalTrack) -> str:
    """Return the range of a signal, or its states, as text."""
    if track.states is None:
        return f"{track.low:g} .. {track.high:g} {track.unit}".rstrip()
    return ", ".join(dict.fromkeys(state for _, state in track.states.changes))


def _live(
    series: Sequence[Series], request: _GraphRequest, now_us: int, width: int, height: int
) -> list[str]:
    view = View(now_us - max(1, request.window_us), now_us, request.ranges, None, now_us)
    return render(series, view, width, height, colour="NO_COLOR" not in os.environ)


_NOTHING_SHOWN: Final = 1


def _show(source: str, collector: Collector, request: _GraphRequest) -> bool:
    """Write the files, or else print the picture. Return whether the picture contains a sample."""
    series = collector.series
    for one in series:
        if not one:
            click.echo(f"{one.label}: no samples", err=True)
        if one.not_numbers:
            click.echo(f"{one.label}: {one.not_numbers} samples are no numbers", err=True)
    view = request.view(series, collector.first_us)
    if missed := _missed(series, view):
        click.echo(missed, err=True)
    for file in request.files:
        write_graph(file, series, view, request.size, _title(source, view, request.title))
    if not request.files:
        width, height = shutil.get_terminal_size(_NO_TERMINAL)
        colour = sys.stdout.isatty() and "NO_COLOR" not in os.environ
        lines = render(series, view, width, min(height - 1, _NO_TERMINAL[1]), colour=colour)
        show = partial(paint, sys.stdout) if colour else click.echo
        show("\n".join(line.rstrip() for line in lines) + "\n" * colour)
    return any(series) and not missed


def _missed(series: Sequence[Series], view: View) -> str:
    """Return a message if all samples lie outside a view, and an empty text otherwise."""
    whole = View.of(series)
    if not any(series) or (whole.from_us <= view.to_us and view.from_us <= whole.to_us):
        return ""
    spans = [
        f"{one.seconds(one.from_us):g} to {one.seconds(one.to_us):g} s"
        for one in (view, replace(whole, origin_us=view.origin_us))
    ]
    return f"no sample from {spans[0]}; the samples are from {spans[1]}"


def _title(source: str, view: View, title: str) -> str:
    """Return the title of a picture, with its content, its source, and the start of its time."""
    begun = f"0 s is {date_text(view.origin_us)}" if view.origin_us >= DATED_US else ""
    name = Path(source).name if Path(source).is_file() else source
    return ", ".join(filter(None, [one_line(title), one_line(name), begun]))


explained(command)
