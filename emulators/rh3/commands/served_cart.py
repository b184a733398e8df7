"""A cart in real time for other programs: `rh3 serve`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from math import degrees
from pathlib import Path
from typing import Final

import click

from tickrig.emulators.rh3.commands.cart_options import MotionOptions
from tickrig.host.cli.control import serving_control, stopped_by_signals
from tickrig.host.cli.engine_options import EngineOptions
from tickrig.host.cli.messages import say, warnings_shown
from tickrig.host.control.clock import ServingClock
from tickrig.host.control.requests import Object, short
from tickrig.host.control.server import ControlServer
from tickrig.host.rtc import connect
from tickrig.host.rtc.commands.console import Console
from tickrig.host.rtc.commands.system_control import SystemControl
from tickrig.host.rtc.engines.engines_joined import engines_joined
from tickrig.host.rtc.motion.chain import MotionChain
from tickrig.host.rtc.motion.drive import PERIOD_US, BaseConnection, stop
from tickrig.host.rtc.motion.geometry import Pose, Twist
from tickrig.host.rtc.motion.path_file import in_degrees
from tickrig.host.rtc.system.call_queue import CallQueue
from tickrig.host.rtc.system.schedule import LATE_US

_NOT_HERE: Final = ("create", "delete", "save")
"""System requests that a cart refuses, because its six components are fixed."""


class CartClock(ServingClock):
    """Real-time clock of a served cart: it serves requests while it waits, and counts delays.

    Attributes:
        late_ticks: number of waits that started more than `LATE_US` late.
        worst_late_us: largest delay of a wait, in microseconds.
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
    """Runs a cart in real time until it is stopped, and serves requests between its periods.

    Args:
        connection: connection to the base of the cart, with the RT components.
        clock: clock that waits for each period.

    Attributes:
        running: whether the cart runs. The value is false after a call of `stop`.
        after_tick: functions that are called after each period, with the time in microseconds.
        server: server of the control socket, or None without a control socket.
    """

    def __init__(self, connection: BaseConnection, clock: CartClock) -> None:
        self._connection, self._clock, self.running = connection, clock, True
        self.server: ControlServer | None = None
        self.after_tick: list[Callable[[int], None]] = []

    @property
    def late_ticks(self) -> int:
        """Number of late periods."""
        return self._clock.late_ticks

    @property
    def worst_late_us(self) -> int:
        """Largest delay of a period."""
        return self._clock.worst_late_us

    def attach(self, calls: CallQueue) -> None:
        """Run the calls of other threads while the cart waits."""
        if self.server is not None:
            self.server.attach(calls, calls.make)
        else:
            self._clock.serve = calls.serve

    def run(self) -> None:
        """Run until `stop` is called."""
        while self.running:
            self._connection.run_to(self._connection.now_us + PERIOD_US)
            for listener in tuple(self.after_tick):
                listener(self._connection.now_us)

    def stop(self) -> None:
        """End `run` after the present period."""
        self.running = False


class CartControl(SystemControl):
    """Answers requests to a running cart.

    The requests are goals and paths, and all requests that `SystemControl` answers.

    Goals and paths are commands of the component PositionInput.

    Args:
        connection: the connected base and its RT components. Its attribute `now_us` must not change
            while a request is answered.
        cart: the running cart.
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
    """Run a cart until Ctrl-C or until another program ends the run.

    At the end the components of the cart are deactivated.

    Lines typed on standard input are commands of the component PositionInput. When standard input
    ends and no other program can reach the cart, the run ends after the last command.

    Another program can send velocities to the cart, for example on a topic of ROS 2. The cart
    follows these velocities while no command of PositionInput runs.

    Args:
        options: options of the cart and its base.
        engines: connections to OpenRTM and ROS 2.
        control: path of the control socket, or None for no control socket.

    Raises:
        Refused: there is no cart, or the connection to OpenRTM or ROS 2 or the control socket
            cannot be opened.
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
    """Read standard input after each period; stop the cart when no more commands can arrive."""
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
    """If velocities come from a peer, let PathFollower drive only while a command runs."""
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
