"""Verbs of `rh3`: runs with the options of its command line."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from math import nan
from pathlib import Path
from shutil import get_terminal_size
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import click

from tickrig.emulators.commands.picture import check_plot, new_figure, write_figure
from tickrig.emulators.rh3.commands.cart_options import MotionOptions, require_arrival
from tickrig.emulators.rh3.commands.served_cart import serve_cart
from tickrig.emulators.rh3.device_type import read_parameters
from tickrig.emulators.rh3.fields import PARAMETERS
from tickrig.host.cli.control import stopped_by_signals
from tickrig.host.cli.engine_options import take_engines
from tickrig.host.cli.messages import Refused, refuse_path
from tickrig.host.cli.options import NumberRange
from tickrig.host.cli.start import INTERRUPTED, paint
from tickrig.host.rtc.motion.drive import BaseConnection, drive, limits_of, stop, table
from tickrig.host.rtc.motion.geometry import Pose, Wheels
from tickrig.host.rtc.motion.motion_run import WIDTH, LiveMap, MotionRun, TrackMap, TrackSample
from tickrig.host.rtc.motion.path_file import FARTHEST_M, read_path, within_reach
from tickrig.host.rtc.motion.ports import plausible
from tickrig.host.rtc.motion.umbmark import SIDE_M, Umbmark, run_umbmark, square
from tickrig.host.text.whole_file import write_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


# Default ROS 2 topics of a cart.

_TOPICS: Final = Path(__file__).with_name("topics.toml").read_text("utf-8")

_SCAN: Final = Path(__file__).with_name("scan_topic.toml").read_text("utf-8")
"""Topics of a cart with a range finder."""


# A run as a picture: path, cross-track error and velocities; needs the extra `plot`.


def _draw(run: MotionRun, points: Sequence[Pose], title: str) -> Figure:
    figure = new_figure(9, 9)
    figure.suptitle(title)
    ground, beside, speed, turn = figure.subplots(4, 1, height_ratios=(4, 1, 1, 1))
    samples, times = run.samples, [sample.time_s for sample in run.samples]
    _draw_ground(ground, run, points)
    beside.plot(times, [_beside_mm(s.line, s.pose) for s in samples], color="tab:red")
    beside.set_ylabel("off line, mm")
    speed.plot(times, [sample.twist.v for sample in samples], color="tab:blue")
    speed.set_ylabel("forward, m/s")
    turn.plot(times, [sample.twist.w for sample in samples], color="tab:orange")
    turn.set_ylabel("turning, rad/s")
    turn.set_xlabel("time, s")
    beside.sharex(turn)
    speed.sharex(turn)
    for axes in (ground, beside, speed, turn):
        axes.grid(visible=True, alpha=0.3)
    return figure


def _draw_ground(axes: Axes, run: MotionRun, points: Sequence[Pose]) -> None:
    track = [sample.pose for sample in run.samples]
    axes.plot([p.x for p in points], [p.y for p in points], "+", color="tab:gray", label="points")
    axes.plot([p.x for p in track], [p.y for p in track], color="tab:blue", label="track")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    axes.legend(loc="best")


def _beside_mm(line: Pose | None, pose: Pose) -> float:
    return nan if line is None else line.left(pose) * 1e3


# What a user does while a cart drives.


class _RunStopped(Exception):  # noqa: N818 - no error
    """The user has ended the run."""


class _RunWatcher:
    """Draws samples if requested, and raises `_RunStopped` after a signal."""

    def __init__(self, options: MotionOptions, points: Sequence[Pose]) -> None:
        self._ended = self._asking = False
        width = min(WIDTH, get_terminal_size().columns - 1)
        drawn = partial(paint, sys.stdout)
        self._map = LiveMap(TrackMap(points, width), drawn) if options.show_map else None

    def end(self) -> None:
        """Stop at the next sample, or at once during a question."""
        self._ended = True
        if self._asking:
            raise KeyboardInterrupt

    @contextmanager
    def asking(self) -> Iterator[None]:
        """Ask the user a question; raise `_RunStopped` if the user ends the run."""
        self._asking = True
        try:
            yield
        except (click.Abort, KeyboardInterrupt):
            raise _RunStopped from None
        finally:
            self._asking = False
        if self._ended:  # click.pause passes Ctrl-C over
            raise _RunStopped

    def watch(self, sample: TrackSample) -> None:
        """Handle a sample."""
        if self._map is not None:
            self._map.watch(sample)
        if self._ended:
            raise _RunStopped


@contextmanager
def _watched(options: MotionOptions, points: Sequence[Pose]) -> Iterator[_RunWatcher]:
    """Watch a run; Ctrl-C ends it with exit status 130."""
    watcher = _RunWatcher(options, points)
    with stopped_by_signals(watcher.end):
        try:
            yield watcher
        except _RunStopped:
            click.echo("stopped", err=True)
            raise SystemExit(INTERRUPTED) from None


# `rh3 square`: UMBmark before and after a calibration.


class SquarePlan(NamedTuple):
    """Number and size of the squares in each direction."""

    runs: int
    side_m: float

    @property
    def corners(self) -> list[Pose]:
        """All corners of both directions."""
        there, back = (square(clockwise=way, side_m=self.side_m) for way in (True, False))
        return [*there, *back]


class _Squares:
    """Squares of one run of `rh3`; each square starts with a cart at the origin.

    Args:
        options: the options.
        size: number and size of the squares.
        watcher: function that receives each sample.

    Attributes:
        latest: the connection of the latest square.
    """

    def __init__(self, options: MotionOptions, size: SquarePlan, watcher: _RunWatcher) -> None:
        self._options, self._size, self._watcher = options, size, watcher
        self.latest: BaseConnection | None = None

    def run(self, wheels: Wheels | None = None) -> Umbmark:
        """Drive squares, with the given radii and axle or with the usual ones."""
        try:
            return run_umbmark(
                lambda number: self._begin(wheels),
                self._true_pose,
                self._size.runs,
                self._size.side_m,
                self._watcher.watch,
            )
        except TimeoutError as error:
            error_reason = self.latest.chain.ref_hard.error_reason if self.latest else ""
            raise click.ClickException(error_reason or str(error)) from None

    def stop(self) -> None:
        """Stop the cart."""
        if self.latest is not None:
            stop(self.latest)

    def _begin(self, wheels: Wheels | None) -> BaseConnection:
        self.stop()
        if self._options.device is not None:
            with self._watcher.asking():
                click.pause("Put the cart at its start, and press a key.")
        self.latest = self._options.begin(wheels)
        return self.latest

    def _true_pose(self, connection: BaseConnection) -> Pose:
        if self._options.device is None:
            return connection.pose
        with self._watcher.asking():
            x_mm, y_mm = (
                click.prompt(f"Measured {axis} of the cart from its start, mm", type=NumberRange())
                for axis in ("x", "y")
            )
        return Pose(x_mm / 1e3, y_mm / 1e3)


def run_squares(options: MotionOptions, size: SquarePlan, save: Path | None) -> None:
    """Drive squares, calibrate, drive the squares again, and print the results of both runs."""
    with _watched(options, size.corners) as watcher:
        squares = _Squares(options, size, watcher)
        try:
            before = squares.run()
            assert squares.latest is not None
            corrected = before.corrected(squares.latest.chain.odometry.wheels, size.side_m)
            after = squares.run(corrected)
        finally:
            squares.stop()
    click.echo("              before   after")
    _print_row("E_max,syst", before.most_m, after.most_m)
    _print_row("return, most", max(before.returns_m), max(after.returns_m))
    text = (
        f"conf.default.radiusOfLeftWheel: {corrected.left:.7f}\n"
        f"conf.default.radiusOfRightWheel: {corrected.right:.7f}\n"
        f"conf.default.lengthOfAxle: {corrected.axle:.7f}\n"
    )
    click.echo(text, nl=False)
    if save is not None:
        try:
            write_whole(save, text)
        except OSError as error:
            refuse_path("save", error)


def _print_row(what: str, before_m: float, after_m: float) -> None:
    click.echo(f"{what:<12} {before_m * 1e3:7.1f} {after_m * 1e3:7.1f} mm")


def go_to(x: float, y: float, theta: float, **options: Any) -> None:
    """Drive to a pose, in metres and radians."""
    if not plausible(x, y, theta):
        raise Refused(f"{x:g} {y:g} {theta:g} is no pose: metres, metres, radians")
    if not within_reach(goal := Pose(x, y, theta)):
        raise Refused(f"{x:g} {y:g} {theta:g} is beyond {FARTHEST_M} m")
    _drive(_checked(options), [goal], f"rh3 goto {x:g} {y:g} {theta:g}")


def go_along(file: Path, **options: Any) -> None:
    """Drive along the points of a file."""
    try:
        points = read_path(file)
    except ValueError as error:
        raise Refused(str(error)) from None
    _drive(_checked(options), points, f"rh3 path {file.name}")


def go_round(runs: int | None, side: float | None, save: Path | None, **options: Any) -> None:
    """Drive squares in both directions, `runs` times or a suitable number."""
    checked = _checked(options)
    by_chance = checked.device is not None or checked.base.noise
    run_squares(checked, SquarePlan(runs or (5 if by_chance else 1), side or SIDE_M), save)


def serve(**options: Any) -> None:
    """Run a cart in real time until Ctrl-C."""
    room_m = options["room_m"]
    if room_m and options["device"]:
        raise Refused("--room is for the emulated base; a --device has what is around it")
    engines = take_engines(options, _TOPICS + _SCAN if room_m else _TOPICS)
    if engines.ros2 and options["pace"] not in {None, 1.0}:
        raise Refused("--pace is not for --ros2: what others send has real time")
    pace = options["pace"] or (None if options["device"] else 1.0)
    control = options.pop("control")
    serve_cart(_checked({**options, "pace": pace}), engines, control)


def _checked(options: dict[str, Any]) -> MotionOptions:
    given = {name: options.pop(name) for name in (*(field.name for field in PARAMETERS), "seed")}
    if options["device"] is not None and options["pace"] is not None:
        raise Refused("--pace is for the emulated base; a --device has real time")
    if options["any_device"] and options["device"] is None:
        raise Refused("--any-device is for a --device; the emulated base is known")
    if options["show_map"] is None:
        options["show_map"] = sys.stdout.isatty()
    try:
        checked = MotionOptions(**options, base=read_parameters(given))
    except ValueError as error:
        raise Refused(str(error)) from None
    if checked.plot is not None:
        check_plot(checked.plot)  # before the run, not after it
    return checked


def _drive(options: MotionOptions, points: Sequence[Pose], title: str) -> None:
    connection = options.begin()
    began = connection.chain.odometry.pose
    with _watched(options, [began, *points]) as watcher:
        try:
            run = drive(connection, points, watcher.watch)
            require_arrival(connection, run)
        finally:
            stop(connection)
    for line in table(run, began, points, limits_of(connection.chain)):
        click.echo(line)
    if options.plot is not None:
        try:
            write_figure(_draw(run, points, title), title, options.plot)
        except OSError as error:
            refuse_path("plot", error)
