"""Output of `tickrig run` after a run: curves of signals, and a page of the whole run."""

from __future__ import annotations

import os
import shlex
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from itertools import pairwise
from math import isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import click

from tickrig._lazy import LazyModule
from tickrig.device.physical import OutputSignal
from tickrig.emulators.commands import picture
from tickrig.emulators.rig.emulated import Inputs, read_signal
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.modes.virtual_mode import VirtualMode
from tickrig.emulators.testing.plugin.bench_evidence import BenchWitness, SignalSampler
from tickrig.emulators.testing.report import bench_report
from tickrig.emulators.testing.report.report_file import check_report
from tickrig.emulators.testing.rig_file.plan import RigPlan
from tickrig.host.canmon.model.graph import plot, series
from tickrig.host.cli.messages import Refused, refuse_path, refused_at, refusing
from tickrig.host.text.names import near
from tickrig.host.text.values import Setting, format_time
from tickrig.host.text.whole_file import check_file, check_not_read, replacing, write_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from tickrig.emulators.testing.report import page
    from tickrig.host.canmon.output import graph_file
else:
    page = LazyModule("tickrig.emulators.testing.report.page")  # Jinja2, an extra
    graph_file = LazyModule("tickrig.host.canmon.output.graph_file")

# Signals by the names that people write.

_CSV: Final = ".csv"
_SLASH: Final = "/"
_PAGES: Final = (".html", ".htm")


class _Signals:
    """All signals of a bench that can be drawn: inputs, outputs, and signals of its rig file.

    Args:
        rig: rig of the bench.
    """

    def __init__(self, rig: BenchRig) -> None:
        self._assembly = rig.state.assembly
        self.inputs: Inputs = self._assembly.inputs
        self.tick_us = self._assembly.tick_us
        self._drivers = {
            name: driver
            for driver in rig.state.drivers
            for name in driver.names
            if _SLASH not in name
        }
        named = {name: OutputSignal(name, "signal of the rig file") for name in self._drivers}
        self.outputs = {**self._assembly.outputs, **named}

    def read(self, name: str, /) -> Setting:
        """Return the present value of an output; raise KeyError if the name is unknown."""
        driver = self._drivers.get(name)
        return self._assembly.read(name) if driver is None else driver.value(name)

    def find(self, word: str) -> str:
        """Return the full name of a signal from the word that the user wrote.

        Args:
            word: text such as `left/shaft_deg` or `left.shaft_deg`, or `shaft_deg` if only one
                device has this signal.

        Raises:
            ValueError: the word fits no signal, or it fits several signals, or the value of the
                signal is a text.
        """
        names = dict.fromkeys((*self.outputs, *self.inputs.table))
        lone = next(iter(self._assembly.parts)) if len(self._assembly.parts) == 1 else ""
        full = word.replace(".", _SLASH, 1)
        tried = word, full, word.removeprefix(f"{lone}."), full.removeprefix(f"{lone}{_SLASH}")
        found = next((one for one in tried if one in names), "")
        if not found:
            meant = [name for name in names if name.rpartition(_SLASH)[2] == word]
            if len(meant) > 1:
                raise ValueError(f"{word!r} is of several devices: {', '.join(meant)}")
            if not meant:
                shown = [name for name in names if not name.rpartition(_SLASH)[2].startswith("0x")]
                raise ValueError(f"no signal {word!r}; {near(full, shown)}")
            found = meant[0]
        if isinstance(value := read_signal(self, found), str):
            raise ValueError(f"{found} is a text, as {value!r}; a curve needs numbers")
        return found

    def unit(self, name: str) -> str:
        """Return the unit of a signal."""
        output = self.outputs.get(name)
        return output.unit if output else self.inputs.table[name].unit


class _Diagram(NamedTuple):
    """Diagram of an option `--plot`: curves over time, or a path.

    Attributes:
        names: names of the signals; the names of a path are x and y.
        is_path: whether the diagram shows y over x.
    """

    names: tuple[str, ...]
    is_path: bool = False


def _diagram_of(text: str, signals: _Signals) -> _Diagram:
    """Read `NAME[,NAME...]` or `X:Y`; raise ValueError if a name is unknown.

    Objects of CANopen nodes have a colon in their names, so each colon is tried.
    """
    words = [word.strip() for word in text.split(",")]
    if len(words) == 1:
        for at in (at for at, letter in enumerate(text) if letter == ":"):
            try:
                pair = signals.find(text[:at].strip()), signals.find(text[at + 1 :].strip())
            except ValueError:
                continue
            return _Diagram(pair, is_path=True)
        if _is_path(text):
            left, _, right = text.partition(":")
            return _Diagram((signals.find(left.strip()), signals.find(right.strip())), is_path=True)
    if any(Path(word).suffix in (".png", ".svg", ".html", _CSV) for word in words):
        raise ValueError(f"it takes names of signals; for the file write -o {text}")
    for word in words if len(words) > 1 else ():
        if _is_path(word):
            raise ValueError(f"a path stands alone: --plot {word} --plot SIGNALS")
    return _Diagram(tuple(dict.fromkeys(map(signals.find, words))))


def _is_path(word: str) -> bool:
    """Return whether a word is meant as `X:Y`, not as an object of a node with a sub-index."""
    left, colon, _ = word.partition(":")
    return bool(colon) and not left.rpartition(_SLASH)[2].startswith("0x")


# What is kept of them while the run goes on.

_MOST: Final = 50_000
"""Largest number of samples of a curve, and of points of a path."""


@dataclass(slots=True)
class _PathSampler:
    """Records pairs of values; if there are too many, every other pair is dropped.

    Args:
        take_pair: function that returns the present pair of values.
    """

    take_pair: Callable[[], tuple[float, float]]
    points: list[tuple[float, float]] = field(default_factory=list)

    def take(self, now_us: int) -> None:
        """Record the present pair."""
        pair = self.take_pair()
        if all(map(isfinite, pair)) and (not self.points or self.points[-1] != pair):
            self.points.append(pair)
            if len(self.points) > 2 * _MOST:
                del self.points[1::2]


class RunPlots:
    """Curves of signals during a run, for the options `--plot SIGNALS` and `-o FILE`.

    Args:
        words: texts of the options `--plot`, each for one diagram: `NAME[,NAME...]` for curves over
            time, or `X:Y` for a diagram of Y over X.
        files: files for the curves, or empty to draw in the terminal.
        inputs: files that the run reads, which must not be overwritten.

    Raises:
        Refused: one of `files` cannot be written. This is checked before the run.
    """

    def __init__(
        self, words: Sequence[str], files: Sequence[Path], inputs: Sequence[Path] = ()
    ) -> None:
        if files and not words:
            raise Refused("-o needs signals: --plot x_m,y_m")
        for file in files:
            with refusing():
                check_not_read(file, "-o", inputs)
                if file.suffix.lower() == _CSV:
                    check_file(file, "-o")
            if file.suffix.lower() != _CSV:
                picture.check_plot(file, "-o", _CSV)
        self._words, self._files = words, files
        self._diagrams: list[_Diagram] = []
        self._paths: dict[_Diagram, _PathSampler] = {}

    def watch(self, rig: BenchRig) -> None:
        """Record the signals from now on; raise Refused if a name is unknown."""
        self._signals = signals = _Signals(rig)
        with refused_at("--plot"):
            self._diagrams = [_diagram_of(word, signals) for word in self._words]
        names = dict.fromkeys(name for one in self._diagrams for name in one.names)
        self._sampler = SignalSampler(signals, names, most=_MOST)
        self._paths = {one: self._path(one) for one in self._diagrams if one.is_path}
        self._takers = [self._sampler.take, *(one.take for one in self._paths.values())]
        for take in self._takers:
            take(rig.rig.now_us)
            rig.rig.watchers.append(take)

    def _path(self, diagram: _Diagram) -> _PathSampler:
        x, y = diagram.names

        def pair() -> tuple[float, float]:
            return float(read_signal(self._signals, x)), float(read_signal(self._signals, y))

        return _PathSampler(pair)

    @property
    def paths(self) -> list[page.PagePath]:
        """The recorded paths, for a page."""
        if not self._paths:
            return []
        unit = self._signals.unit
        return [
            page.PagePath((x, unit(x)), (y, unit(y)), tuple(sampler.points))
            for (x, y), sampler in ((one.names, sampler) for one, sampler in self._paths.items())
        ]

    def finish(self, now_us: int, title: str) -> None:
        """Write the curves of the finished run to the files, or draw them in the terminal.

        Args:
            now_us: time of the end of the run, in microseconds.
            title: title of the diagrams.

        Raises:
            Refused: a file cannot be written.
        """
        for take in self._takers:
            take(now_us)
        taken = {one.name: one for one in self._sampler.series()}
        try:
            for file in self._files:
                self._write(file, taken, title)
        except OSError as error:
            refuse_path("-o", error)
        for number, diagram in enumerate(self._diagrams if not self._files else ()):
            click.echo("\n" * bool(number), nl=False)
            lines = self._path_lines(diagram) if diagram.is_path else _lines(diagram, taken)
            click.echo("\n".join(line.rstrip() for line in lines))

    def _write(self, file: Path, taken: dict[str, bench_report.SignalSeries], title: str) -> None:
        if file.suffix.lower() != _CSV:
            picture.write_figure(self._figure(taken, title), title, file)
            return
        curves = [_curve(one) for one in taken.values()]
        with replacing(file) as beside, beside.open("w", encoding="utf-8", newline="") as text:
            graph_file.write_csv(text, curves, _view(curves))

    def _figure(self, taken: dict[str, bench_report.SignalSeries], title: str) -> Figure:
        heights = [2 if one.is_path else 1 for one in self._diagrams]
        figure = picture.new_figure(9, 1 + 2.5 * sum(heights))
        figure.suptitle(title)
        fields = figure.subplots(len(heights), 1, height_ratios=heights, squeeze=False)
        for axes, diagram in zip(fields[:, 0], self._diagrams, strict=True):
            axes.grid(visible=True, alpha=0.3)
            if diagram.is_path:
                self._draw_path(axes, diagram)
            else:
                _draw_curves(axes, [taken[name] for name in diagram.names])
        return figure

    def _draw_path(self, axes: Axes, diagram: _Diagram) -> None:
        points = self._paths[diagram].points or [(nan, nan)]
        axes.plot([x for x, _ in points], [y for _, y in points], color="tab:blue")
        axes.plot(*points[0], "o", color="tab:green", label="start")
        axes.plot(*points[-1], "s", color="tab:red", label="end")
        axes.legend(loc="best")
        units = [self._signals.unit(name) for name in diagram.names]
        if units[0] == units[1]:
            axes.set_aspect("equal", adjustable="datalim")
        titles = [f"{n}, {u}" if u else n for n, u in zip(diagram.names, units, strict=True)]
        axes.set_xlabel(titles[0])
        axes.set_ylabel(titles[1])

    def _path_lines(self, diagram: _Diagram) -> Iterator[str]:
        """Yield a path as lines for a terminal; x and y have one scale if they have one unit."""
        points = self._paths[diagram].points
        if not points:
            yield f"{':'.join(diagram.names)}: no samples"
            return
        width, height = _size()
        canvas = plot.Canvas(width, height - 3)
        ranges = [plot.widened(min(column), max(column)) for column in zip(*points, strict=True)]
        dots = (width * plot.DOTS_X - 1, (height - 3) * plot.DOTS_Y - 1)
        scales = [dot / (high - low) for dot, (low, high) in zip(dots, ranges, strict=True)]
        units = [self._signals.unit(name) for name in diagram.names]
        if units[0] == units[1]:
            scales = [min(scales)] * 2
        (left, _), (_, top) = ranges
        places = [(round((x - left) * scales[0]), round((top - y) * scales[1])) for x, y in points]
        for (x0, y0), (x1, y1) in pairwise([places[0], *places]):
            for part in range(steps := max(abs(x1 - x0), abs(y1 - y0), 1)):
                y = y1 + (y0 - y1) * part // steps
                canvas.fill(x1 + (x0 - x1) * part // steps, y, y)
        for name, unit, (low, high) in reversed(
            list(zip(diagram.names, units, ranges, strict=True))
        ):
            yield f"{name} {low:.6g} .. {high:.6g} {unit}".rstrip()
        for row in range(height - 3):
            yield "".join(letter for letter, _ in canvas.row(row))


def _size() -> tuple[int, int]:
    width, height = shutil.get_terminal_size((100, 28))
    return max(width, 30), min(max(height - 1, 10), 28)


def _curve(taken: bench_report.SignalSeries) -> series.Series:
    """Return a signal as `canmon graph` draws it; a stepped signal holds each value."""
    curve, before = series.Series(taken.name, unit=taken.unit), None
    for at_us, value in taken.points:
        if isinstance(value, int | float):
            if taken.steps and before is not None:
                curve.append(at_us, before)
            curve.append(at_us, before := float(value))
    return curve


def _view(curves: Sequence[series.Series]) -> series.View:
    end_us = max((one.at_us[-1] for one in curves if one.at_us), default=0)
    return series.View(0, max(end_us, 1))


def _lines(diagram: _Diagram, taken: dict[str, bench_report.SignalSeries]) -> list[str]:
    """Return curves as lines for a terminal; the second unit has its own axis."""
    curves = [_curve(taken[name]) for name in diagram.names]
    units = list(dict.fromkeys(curve.unit for curve in curves))
    for curve in curves:
        curve.axis = min(1 + units.index(curve.unit), 2)
    colour = sys.stdout.isatty() and "NO_COLOR" not in os.environ
    return plot.render(curves, _view(curves), *_size(), colour=colour)


def _draw_curves(first: Axes, taken: Sequence[bench_report.SignalSeries]) -> None:
    """Draw curves over time; the second unit has its own axis, on the right."""
    units = list(dict.fromkeys(one.unit for one in taken))[:2]
    fields = {units[0]: first, **{unit: first.twinx() for unit in units[1:]}}
    lines = []
    for one, colour in zip(taken, (plot.COLOURS * len(taken)), strict=False):
        points = [(at_us / 1e6, value) for at_us, value in one.points if value is not None]
        lines += fields.get(one.unit, first).plot(
            [second for second, _ in points],
            [value for _, value in points],
            drawstyle="steps-post" if one.steps else "default",
            color=colour,
            label=f"{one.name}, {one.unit}" if one.unit else one.name,
        )
    for unit, axes in fields.items():
        axes.set_ylabel(unit)
    first.set_xlabel("time, s")
    first.legend(handles=lines, loc="best")


# The page of a run.


@dataclass(slots=True)
class RunPage:
    """HTML page about a run, for the option `--report FILE`.

    Args:
        path: path of the page.
        plan: content of the rig file.
        words: words of the command line that repeats the run.
        inputs: files that the run reads, which must not be overwritten.

    Raises:
        Refused: the page cannot be written. This is checked before the run.
    """

    path: Path
    plan: RigPlan
    words: Sequence[str]
    inputs: Sequence[Path] = ()
    _witness: BenchWitness = field(init=False)
    _rig: BenchRig = field(init=False)
    _begun: datetime = field(init=False)

    def __post_init__(self) -> None:
        """Check the path."""
        if self.path.suffix.lower() not in _PAGES:
            raise Refused(f"--report {self.path}: the name ends in {', '.join(_PAGES)}")
        with refusing():
            check_not_read(self.path, "--report", self.inputs)
            check_report(self.path)

    def watch(self, rig: BenchRig) -> None:
        """Record the bench from now on."""
        self._rig, self._begun = rig, datetime.now().astimezone()
        self._witness = BenchWitness(Bench.of_mode(VirtualMode(rig)))

    def finish(
        self, *, virtual: bool, rows: Iterable[Sequence[str]], paths: Sequence[page.PagePath]
    ) -> None:
        """Write the HTML page of the finished run.

        Args:
            virtual: whether the run was in virtual time.
            rows: rows of the table of wires: the name of a wire, its address for hosts, its rate,
                and its devices.
            paths: diagrams with one signal on the x axis and another signal on the y axis.

        Raises:
            Refused: the page cannot be written.
        """
        seen, rig, file = self._witness.evidence(), self._rig, self.plan.path
        record = bench_report.TestRecord(
            file.name if file else "bench",
            bench_report.Outcome.PASSED,
            mode="virtual" if virtual else "real",
            virtual_us=seen.now_us,
            seed=self.plan.seed,
            command=shlex.join(self.words),
            faults=seen.faults,
            journal=seen.journal,
            journal_left_out=seen.left_out,
            series=seen.series,
            trace=seen.trace,
        )
        late = "" if virtual else f"; late ticks: {rig.rig.late_ticks}"
        environment = bench_report.RunEnvironment(
            self._begun.strftime("%Y-%m-%d %H:%M:%S %z"),
            record.mode,
            record.seed,
            record.nodeid,
            file.read_text("utf-8", "replace") if file else "",
        ).of_this_machine()
        told = f"ran {format_time(seen.now_us)} s{late}"
        text = page.run_page(replace(record, reason=told), environment, tuple(rows), paths)
        try:
            write_whole(self.path, text)
        except OSError as error:
            refuse_path("--report", error)
