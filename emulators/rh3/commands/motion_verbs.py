"""What `rh3` does: runs of the options of its command line."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import click

from tickrig.emulators.commands.picture import check_plot, new_figure, write_figure
from tickrig.emulators.rh3.device_type import read_parameters
from tickrig.emulators.rh3.fields import PARAMETERS
from tickrig.host.cli.engine_options import take_engines
from tickrig.host.cli.messages import Refused, refuse_path
from tickrig.host.cli.options import NumberRange
from tickrig.host.rtc.motion.drive import (
    SIDE_M,
    BaseConnection,
    Umbmark,
    drive,
    limits_of,
    run_umbmark,
    square,
    stop,
    table,
)
from tickrig.host.rtc.motion.geometry import Pose, Wheels
from tickrig.host.rtc.motion.motion_run import MotionRun
from tickrig.host.rtc.motion.path_file import FARTHEST_M, read_path, within_reach
from tickrig.host.rtc.motion.ports import plausible
from tickrig.host.text.whole_file import write_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from math import degrees
from shutil import get_terminal_size

from tickrig.device.rh3.parameters import BaseParameters
from tickrig.device.urg.world import room
from tickrig.emulators.rh3.closed_loop import ClosedLoop, MountedUrg
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.host.cli.control import serving_control, stopped_by_signals
from tickrig.host.cli.engine_options import EngineOptions
from tickrig.host.cli.messages import say, warnings_shown
from tickrig.host.cli.start import INTERRUPTED, paint
from tickrig.host.control.clock import RealClock, ServingClock
from tickrig.host.control.requests import Object, short
from tickrig.host.control.server import ControlServer
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rtc import Manager, connect
from tickrig.host.rtc.commands.console import Console
from tickrig.host.rtc.commands.system_control import SystemControl
from tickrig.host.rtc.engines.engines_joined import engines_joined
from tickrig.host.rtc.motion.chain import RATE_HZ, MotionChain
from tickrig.host.rtc.motion.drive import PERIOD_US, start
from tickrig.host.rtc.motion.geometry import Twist
from tickrig.host.rtc.motion.motion_run import WIDTH, LiveMap, TrackMap, TrackSample
from tickrig.host.rtc.motion.options.lrf_capture_urg import LrfCaptureUrg
from tickrig.host.rtc.motion.path_file import in_degrees
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.call_queue import CallQueue
from tickrig.host.rtc.system.schedule import LATE_US, RealTime

# A cart in real time, for others to work with: `rh3 serve`.
_NOT_HERE: Final = ("create", "delete", "save")
"""Requests of a system that a cart refuses: it has its six components."""


class CartClock(ServingClock):
    """The machine's clock, which serves while it waits and notes what is late.

    Attributes:
        late_ticks: how many waits began more than `LATE_US` late.
        worst_late_us: by how much the worst of them was late.
    """

    late_ticks = 0
    worst_late_us = 0

    def wait_until(self, t_us: int, /) -> int:
        """Serve, then sleep until `t_us`."""
        late_us = super().wait_until(t_us)
        self.late_ticks += late_us > LATE_US
        self.worst_late_us = max(self.worst_late_us, late_us)
        return late_us


class ServedCart:
    """Moves a cart on until somebody stops it; others are served while it waits.

    Args:
        connection: the cart, with its components.
        clock: what the cart waits by.

    Attributes:
        running: False once `stop` was called.
        after_tick: called with the time in us after each period.
        server: the control socket, None without one.
    """

    def __init__(self, connection: BaseConnection, clock: CartClock) -> None:
        self._connection, self._clock, self.running = connection, clock, True
        self.server: ControlServer | None = None
        self.after_tick: list[Callable[[int], None]] = []

    @property
    def late_ticks(self) -> int:
        """How many periods began late."""
        return self._clock.late_ticks

    @property
    def worst_late_us(self) -> int:
        """By how much the worst of them was late."""
        return self._clock.worst_late_us

    def attach(self, calls: CallQueue) -> None:
        """Make the calls of other threads while it waits."""
        if self.server is not None:
            self.server.attach(calls, calls.make)
        else:
            self._clock.serve = calls.serve

    def run(self) -> None:
        """Run until somebody calls `stop`."""
        while self.running:
            self._connection.run_to(self._connection.now_us + PERIOD_US)
            for listener in tuple(self.after_tick):
                listener(self._connection.now_us)

    def stop(self) -> None:
        """End `run` after the present period."""
        self.running = False


class CartControl(SystemControl):
    """Answers requests about a cart: those of a system, and the commands of PositionInput.

    Args:
        connection: the cart; it must not be moved on meanwhile.
        cart: what moves it on.
    """

    def __init__(self, connection: BaseConnection, cart: ServedCart) -> None:
        super().__init__(connection.chain.manager, cart)
        self._connection, self._entered = connection, connection.chain.position_input
        self._verbs = {
            **{name: verb for name, verb in self._verbs.items() if name not in _NOT_HERE},
            "goal": (self._goal, ("pose",)),
            "path": (self._path, ("points",)),
            "end": (self._end, ()),
        }

    def _goal(self, request: Object) -> Object:
        self._entered.require_open()
        self._entered.goal(_pose(request.get("pose"), 3))
        return {}

    def _path(self, request: Object) -> Object:
        self._entered.require_open()
        points = request.get("points", [])
        if not isinstance(points, list):
            raise ValueError(f"points is a list of [x, y] or [x, y, deg], not {short(points)}")
        self._entered.path([_pose(point, 2) for point in points] or self._entered.defined_path)
        return {}

    def _end(self, request: Object) -> Object:
        self._entered.require_open()
        self._entered.end()
        return {}

    def _status(self, request: Object) -> Object:
        pose = self._connection.chain.odometry.pose
        return {
            **super()._status(request),
            "finished": self._entered.finished,
            "idle": self._entered.idle,
            "x_m": pose.x,
            "y_m": pose.y,
            "heading_deg": degrees(pose.heading),
        }


def _pose(value: object, least: int) -> Pose:
    numbers = value if isinstance(value, list) else []
    if len(numbers) < least or not all(
        isinstance(each, int | float) and not isinstance(each, bool) for each in numbers
    ):
        raise ValueError(f"a pose is [x, y, deg] in metres and degrees, not {short(value)}")
    return in_degrees(numbers, short(value))


def serve_cart(options: MotionOptions, engines: EngineOptions, control: Path | None = None) -> None:
    """Run a cart until Ctrl-C, or until a peer ends it; then its components are deactivated.

    Lines typed on standard input are commands of PositionInput. When standard input ends and
    no other program can reach the cart, the run ends after the last command.

    Where velocities come from a topic, it obeys these while no command of PositionInput runs.

    Raises:
        Refused: there is no cart, or an engine or control socket cannot be.
    """
    clock = CartClock()
    connection = replace(options, clock=clock).begin()
    cart = ServedCart(connection, clock)
    chain = connection.chain
    names = ", ".join(component.instance_name for component in chain.components)
    reachable = bool(engines) or control is not None
    with warnings_shown(), stopped_by_signals(cart.stop):
        with ExitStack() as stack:
            if control is not None:
                requests = CartControl(connection, cart)
                cart.server = stack.enter_context(serving_control(control, requests, clock))
            if engines:
                stack.enter_context(
                    engines_joined(engines, chain.manager, cart.attach, cart.stop, fixed=True)
                )
            say(f"{names}. Ctrl-C ends.")
            _open_console(cart, chain, reachable=reachable)
            _share_the_helm(cart, chain)
            cart.run()
        clock.serve = None
        failed = not reachable and chain.ref_hard.instance_name in chain.in_error
        stop(connection)
    pose = connection.pose
    click.echo(f"ran {connection.now_us / 1e6:.3f} s; at {pose.x:.3f} {pose.y:.3f} m")
    if failed:
        raise click.ClickException(chain.ref_hard.error_reason)


def _open_console(cart: ServedCart, chain: MotionChain, *, reachable: bool) -> None:
    """Read standard input after each period; stop the cart when no command can come."""
    console = Console(chain.manager, click.echo, say)
    try:
        descriptor = sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):  # none, closed, or no file
        console.is_open = False

    def read(now_us: int) -> None:
        if console.is_open:
            console.read(descriptor)
        elif not reachable and (chain.position_input.idle or chain.in_error):
            cart.stop()

    cart.after_tick.append(read)


def _share_the_helm(cart: ServedCart, chain: MotionChain) -> None:
    """Where velocities come from a peer, let PathFollower drive only while a command runs."""
    follower, base = chain.path_follower.velocity, chain.ref_hard.velocity
    if all(connector.joins_components for connector in base.connectors):
        return

    def steer(now_us: int) -> None:
        connector = follower.connector_to(base)
        stands = chain.path_follower.twist == Twist()
        if not (chain.position_input.idle and stands):
            if connector is None:
                connect(follower, base)
        elif connector is not None:
            connector.end()

    steer(0)
    cart.after_tick.append(steer)


# What the verbs of `rh3` share: a cart as the options say, and how a run of it ends.
_SCANNER: Final = "LRFCapture_URG0"
"""The component of a range finder, if the cart has one."""


class RunStopped(Exception):  # noqa: N818 - no error
    """Somebody ended the run."""


@dataclass(frozen=True, slots=True)
class MotionOptions:
    """The options that all verbs have.

    Attributes:
        set_id: configuration set.
        device: a serial port, None for an emulated base in virtual time.
        baud: its bit rate.
        any_device: whether to drive it without asking who it is.
        pace: how many times as fast as the machine's virtual time passes, None as it goes.
        conf: Odometry.conf.
        show_map: draw the track while it runs.
        base: what the emulated base is like.
        plot: file for a picture.
        clock: what the cart waits by, in real time and with a pace.
        room_m: width and depth of a room around the origin; with one, an emulated base carries a
            range finder.
    """

    set_id: str
    device: str | None
    baud: int
    pace: float | None
    conf: Path | None
    show_map: bool
    base: BaseParameters
    plot: Path | None = None
    clock: RealClock = field(default_factory=RealClock)
    room_m: tuple[float, float] | None = None
    any_device: bool = False

    def begin(self, wheels: Wheels | None = None) -> BaseConnection:
        """Return a cart at the origin with its components active."""
        connection = self._connection()
        try:
            if self.conf is not None:
                connection.chain.odometry.load(self.conf)
            if wheels is not None:
                connection.chain.odometry.calibrate(wheels)
        except RtcRefused as error:
            raise Refused(str(error)) from None
        except OSError as error:
            refuse_path("odometry-conf", error)
        start(connection, self.set_id)
        if connection.chain.in_error:
            raise Refused(connection.chain.ref_hard.error_reason)
        return connection

    def _connection(self) -> BaseConnection:
        if self.device is not None:
            connection = _SerialBaseConnection(self.device, self.baud, self.clock)
            connection.chain.ref_hard.configuration.set("AnyDevice", str(int(self.any_device)))
            return connection
        world = room(*self.room_m) if self.room_m else None
        loop = ClosedLoop(self.base, world=world, pace=self.pace, clock=self.clock)
        for eye in loop.range_finders:
            _add_scanner(loop, eye)
        return loop


def _add_scanner(loop: ClosedLoop, eye: MountedUrg) -> None:
    """Have the scans of a range finder written to a port."""
    scanner = LrfCaptureUrg(_SCANNER, lambda name: SimLink(loop.rig, eye.line.b))
    loop.manager.add(scanner, RATE_HZ)
    loop.manager.activate(_SCANNER)


class _SerialBaseConnection:
    """A `BaseConnection` in real time, over a serial port: a base, or `rh3-emu`.

    Args:
        url: what DeviceFileName is set to; a path or a pyserial URL.
        baud: bit rate in bit/s.
        clock: what it waits by.

    Attributes:
        chain: its components.
    """

    def __init__(self, url: str, baud: int, clock: RealClock | None = None) -> None:
        self._manager = Manager()
        self.chain = MotionChain(self._manager, partial(SerialLink, baud=baud))
        self.chain.ref_hard.configuration.set("DeviceFileName", url)
        self._runner = RealTime(self._manager, clock or RealClock())

    @property
    def now_us(self) -> int:
        """Time since the start."""
        return self._manager.now_us

    @property
    def pose(self) -> Pose:
        """Where odometry takes it to be: nobody else knows."""
        return self.chain.odometry.pose

    def run_to(self, t_us: int) -> None:
        """Wait until it is so late, and run what is due meanwhile."""
        while self.now_us < t_us:
            self._runner.step()


class RunWatcher:
    """Draws samples if they are to be drawn, and raises `RunStopped` when a signal has come."""

    def __init__(self, options: MotionOptions, points: Sequence[Pose]) -> None:
        self._ended = self._asking = False
        width = min(WIDTH, get_terminal_size().columns - 1)
        drawn = partial(paint, sys.stdout)
        self._map = LiveMap(TrackMap(points, width), drawn) if options.show_map else None

    def end(self) -> None:
        """Let the next sample be the last; a question is left at once."""
        self._ended = True
        if self._asking:
            raise KeyboardInterrupt

    @contextmanager
    def asking(self) -> Iterator[None]:
        """Ask somebody something: no samples come; `RunStopped` if that was the answer."""
        self._asking = True
        try:
            yield
        except (click.Abort, KeyboardInterrupt):
            raise RunStopped from None
        finally:
            self._asking = False
        if self._ended:  # click.pause passes Ctrl-C over
            raise RunStopped

    def watch(self, sample: TrackSample) -> None:
        """Take a sample."""
        if self._map is not None:
            self._map.watch(sample)
        if self._ended:
            raise RunStopped


@contextmanager
def watched(options: MotionOptions, points: Sequence[Pose]) -> Iterator[RunWatcher]:
    """Watch a run; Ctrl-C ends it with exit status 130."""
    watcher = RunWatcher(options, points)
    with stopped_by_signals(watcher.end):
        try:
            yield watcher
        except RunStopped:
            click.echo("stopped", err=True)
            raise SystemExit(INTERRUPTED) from None


def require_arrival(connection: BaseConnection, run: MotionRun) -> None:
    """End with a line and exit status 1 if the goal was not reached."""
    if connection.chain.in_error:
        raise click.ClickException(connection.chain.ref_hard.error_reason)
    if run.reached_s is None:
        raise click.ClickException(f"not there after {run.duration_s:.1f} s")


# Topics of ROS 2 for a cart, where no table names others.

_TOPICS: Final = Path(__file__).with_name("topics.toml").read_text("utf-8")

_SCAN: Final = Path(__file__).with_name("scan_topic.toml").read_text("utf-8")
"""With a range finder."""


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


# `rh3 square`: UMBmark before and after a calibration.


class SquarePlan(NamedTuple):
    """How many squares each way, and how large."""

    runs: int
    side_m: float

    @property
    def corners(self) -> list[Pose]:
        """All corners of both ways."""
        there, back = (square(clockwise=way, side_m=self.side_m) for way in (True, False))
        return [*there, *back]


class _Squares:
    """Squares of one run of `rh3`, each with a cart at the origin.

    Args:
        options: the options.
        size: how many, and how large.
        watcher: receives each sample.

    Attributes:
        latest: the connection of the latest square.
    """

    def __init__(self, options: MotionOptions, size: SquarePlan, watcher: RunWatcher) -> None:
        self._options, self._size, self._watcher = options, size, watcher
        self.latest: BaseConnection | None = None

    def run(self, wheels: Wheels | None = None) -> Umbmark:
        """Drive squares; with other radii and axle if they are given."""
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
    """Drive squares, calibrate, drive them again, and print how both went."""
    with watched(options, size.corners) as watcher:
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
    text = _conf(corrected)
    click.echo(text, nl=False)
    if save is not None:
        try:
            write_whole(save, text)
        except OSError as error:
            refuse_path("save", error)


def _print_row(what: str, before_m: float, after_m: float) -> None:
    click.echo(f"{what:<12} {before_m * 1e3:7.1f} {after_m * 1e3:7.1f} mm")


def _conf(wheels: Wheels) -> str:
    """Return an Odometry.conf."""
    return (
        f"conf.default.radiusOfLeftWheel: {wheels.left:.7f}\n"
        f"conf.default.radiusOfRightWheel: {wheels.right:.7f}\n"
        f"conf.default.lengthOfAxle: {wheels.axle:.7f}\n"
    )


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
    """Drive squares both ways, `runs` times or as often as is of use."""
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
    with watched(options, [began, *points]) as watcher:
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
