"""`tickrig demo tkernel`: drive along a corridor, lose the service, keep the position."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from math import hypot, pi
from typing import Any, Final

from tickrig.device.rh3.base import Rh3Base
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.device.ucode_reader import Marker, UcodeReader
from tickrig.emulators.rh3.closed_loop import PLACE, ClosedLoop, Mounted
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.tkernel import node_manager
from tickrig.emulators.tkernel.board import Board
from tickrig.emulators.tkernel.resolution import ResolutionService, opener
from tickrig.emulators.tkernel.ucode_table import UcodeTable
from tickrig.host.rtc import InPort
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.ports.connect import connect
from tickrig.host.rtc.ucode.lookup import Lookup
from tickrig.wire.rtc_types.rtc import TimedLongSeq, TimedPoint2D, TimedStringSeq
from tickrig.wire.ucode import BAUD, MAX_LEVEL

# Where a robot believes it is: odometry, set right by each place that it passes.


@dataclass(slots=True)
class Estimate:
    """The position of a robot on a plane, estimated from its odometry and from infra-red markers.

    Only the demonstration `tickrig demo tkernel` uses this method of estimation.

    Attributes:
        range_m: range of the reader that receives the markers, in metres.
        x_m: estimated position in x, in metres.
        y_m: estimated position in y, in metres. The y axis points to the left of the x axis.
        fixes: number of corrections of the estimate by a marker.
    """

    range_m: float
    x_m: float = 0.0
    y_m: float = 0.0
    fixes: int = 0

    def move(self, dx_m: float, dy_m: float) -> None:
        """Move the estimate by the motion that the odometry has measured."""
        self.x_m += dx_m
        self.y_m += dy_m

    def fix(self, x_m: float, y_m: float, level: int) -> None:
        """Set the distance to a marker from its signal level; keep the estimated direction."""
        away_m = self.range_m * (1 - level / MAX_LEVEL)
        off_x, off_y = self.x_m - x_m, self.y_m - y_m
        if not (believed_m := hypot(off_x, off_y)):
            return
        self.x_m, self.y_m = x_m + off_x * away_m / believed_m, y_m + off_y * away_m / believed_m
        self.fixes += 1

    def error_m(self, x_m: float, y_m: float) -> float:
        """Return the distance between the estimate and a position."""
        return hypot(self.x_m - x_m, self.y_m - y_m)


# The stage: a cart in a corridor with markers, the node that it carries, the service.

_LENGTH_M: Final = 8.0
"""Length of the cart's path along the corridor."""

_BACK_M: Final = 3.0
"""Position at which the way back ends; further markers have not been read before."""

_SPACING_M: Final = 2.0
_ASIDE_M: Final = 1.0
"""Distance of the markers from the path."""

_WORN: Final = 1.12
"""Ratio of the true wheels and tread to those of the odometry, which is wrong in distance, not in
turns."""

_BASE: Final = "http://127.0.0.1:8640"
_WIDE: Final = {"dataport.buffer.length": "64"}


def _corridor() -> tuple[tuple[Marker, ...], UcodeTable]:
    """Return markers every 2 m, on both sides in turn, and a table with their places."""
    places = [
        (_SPACING_M * number, -_ASIDE_M if number % 2 else _ASIDE_M) for number in range(-1, 7)
    ]
    ucodes = [f"00001C{0:016X}{number:010X}" for number in range(1, len(places) + 1)]
    markers = tuple(Marker(ucode, *place) for ucode, place in zip(ucodes, places, strict=True))
    names = [f"place-{number}" for number in range(1, len(places) + 1)]
    contents = {
        name: f'{{"x_m": {x}, "y_m": {y}}}' for name, (x, y) in zip(names, places, strict=True)
    }
    return markers, UcodeTable(dict(zip(ucodes, names, strict=True)), contents)


class _MountedReader(Mounted):
    """A reader in the middle of the axle.

    Args:
        base: base that carries the reader.
        markers: the markers in the surroundings.

    Attributes:
        reader: the reader.
        line: line of the reader. Its end `b` is the host's end.
        station: the reader on its line.
    """

    def __init__(self, base: Rh3Base, markers: tuple[Marker, ...]) -> None:
        self._base, self.reader, self.line = base, UcodeReader(markers=markers), SerialLine(BAUD)
        self.station: Station[bytes] = Station(self.reader, self.line.a)

    def act(self, now_us: int, /) -> None:
        """Set the pose of the reader from the pose of the base."""
        for name in PLACE:
            if self.reader.inputs[name] != (value := self._base.read(name)):
                self.reader.inputs.set(name, value)


class CorridorStage:
    """Emulated cart, board and ucode service of the T-Kernel demonstration, in virtual time.

    The cart drives along a corridor with ucode markers. The board estimates the position of the
    cart from the markers, whose positions it gets from the service.

    Args:
        caches: whether the caches of the board keep their entries while the service is unreachable.

    Attributes:
        service: the service that resolves ucodes.
        board: the emulated board, which runs the position detection.
        loop: closed control loop that drives the cart.
        estimate: the estimated position of the cart.
    """

    def __init__(self, *, caches: bool = True) -> None:
        markers, table = _corridor()
        self.service, self._caches = ResolutionService(table, _BASE), caches
        base = BaseParameters()
        worn = BaseParameters(
            radius_left_m=base.radius_left_m * _WORN,
            radius_right_m=base.radius_right_m * _WORN,
            tread_m=base.tread_m * _WORN,
        )
        self.loop = ClosedLoop(worn, aboard=lambda base: self._mount(base, markers))
        self.estimate = Estimate(self._mounted.reader.parameters.range_m)
        lines = node_manager.BoardLines(self._open, self._open, opener(self.service))
        self._lines, self.board = lines, Board(node_manager.NodeLimits(), self._start, lines)
        self.loop.manager.add_item(self.board)
        self._odometry = self.loop.chain.odometry.pose
        self._probes: list[InPort[Any]] = []
        self._round: dict[str, int] = {}

    @property
    def error_m(self) -> float:
        """Distance between the estimated and the true position."""
        return self.estimate.error_m(self.loop.pose.x, self.loop.pose.y)

    def lookup(self, name: str) -> Lookup[Any]:
        """Return a component of the node that has a cache."""
        assert self.board.manager is not None
        component = self.board.manager.find(name)
        assert isinstance(component, Lookup)
        return component

    def run_to(self, t_us: int) -> None:
        """Run to a time, and update the estimate."""
        self.loop.run_to(t_us)
        pose = self.loop.chain.odometry.pose
        self.estimate.move(pose.x - self._odometry.x, pose.y - self._odometry.y)
        self._odometry = pose
        if self._probes:
            self._fix()

    def _fix(self) -> None:
        """Correct the estimate by the places that were found in the latest round."""
        ucodes, levels, places, points = self._probes
        for found, levels_pct in zip(_taken(ucodes), _taken(levels), strict=True):
            self._round = dict(zip(found.data, levels_pct.data, strict=True))
        for place, point in zip(_taken(places), _taken(points), strict=True):
            if (level := self._round.get(place.data[0])) is not None:
                self.estimate.fix(point.data.x, point.data.y, level)

    def _mount(self, base: Rh3Base, markers: tuple[Marker, ...]) -> _MountedReader:
        self._mounted = _MountedReader(base, markers)
        return self._mounted

    def _open(self, name: str) -> SimLink:
        return SimLink(self.loop.rig, self._mounted.line.b)

    def _start(self, manager: node_manager.NodeManager, stack: ExitStack) -> None:
        node_manager.add_position_detection(manager, self._lines, "", _BASE)
        for name in (node_manager.SETTLEMENT, node_manager.CONTENTS):
            configuration = manager.find(name).configuration
            configuration.set("fresh", "5")
            if not self._caches:
                configuration.set("keep", "5")
        wanted: dict[str, type] = {
            f"{node_manager.READER}.ucodes": TimedStringSeq,
            f"{node_manager.READER}.levels": TimedLongSeq,
            f"{node_manager.CONTENTS}.place": TimedStringSeq,
            f"{node_manager.CONTENTS}.position": TimedPoint2D,
        }
        self._probes = [InPort("in", kind) for kind in wanted.values()]
        for name, probe in zip(wanted, self._probes, strict=True):
            connect(manager.port(name), probe, _WIDE)


def _taken(port: InPort[Any]) -> list[Any]:
    """Return all new values of a port."""
    taken = []
    while port.is_new:
        taken.append(port.read())
    return taken


# `tickrig demo tkernel`: drive along a corridor, lose the service, keep the position.

_Echo = Callable[[str], None]

_SECOND_US: Final = 1_000_000
_STEP_US: Final = 100_000
"""Period of the robot, which is the period of the reader."""

_ROW_US: Final = 2 * _SECOND_US
_BOOTED_US: Final = 4 * _SECOND_US
_LEG_US: Final = 60 * _SECOND_US
"""Time limit for a drive along the corridor."""

_NEAR_M: Final = 0.02
_HEAD: Final = "   time   x true   x odometry   x believed   off     hits stale misses failures"


@dataclass(frozen=True, slots=True)
class Moment:
    """Position errors at one time of the T-Kernel demonstration, for its plot.

    Attributes:
        time_s: time since the start of the drive, in s.
        outage: whether the ucode service was unreachable at this time.
        error_m: distance between the estimated and the true position of the cart, in m.
        odometry_error_m: distance between the position by odometry alone and the true position, in
            m.
    """

    time_s: float
    outage: bool
    error_m: float
    odometry_error_m: float


def run_demo(stage: CorridorStage, echo: _Echo) -> list[Moment]:
    """Run the T-Kernel demonstration.

    The cart drives along the corridor with the ucode service. Then it drives back without the
    service.

    Args:
        stage: cart, board and service, which have not run yet.
        echo: function that is called with each line of the progress report.

    Returns:
        The position errors of both drives, one for every 100 ms.
    """
    moments: list[Moment] = []
    stage.loop.activate("tuned")
    stage.run_to(_BOOTED_US)
    echo("The node has booted. The wheels are worn: for 8.96 m the odometry counts 8 m.\n")
    echo(f"The cart drives {_LENGTH_M:g} m along the corridor; the service answers.\n{_HEAD}")
    _drive(stage, Pose(_LENGTH_M, 0.0, 0.0), moments, echo)
    stage.service.inputs.set("unreachable", 1)
    echo(f"\nThe service is unreachable. The cart drives back.\n{_HEAD}")
    _drive(stage, Pose(_BACK_M, 0.0, pi), moments, echo)
    worst_m = max(moment.error_m for moment in moments if moment.outage)
    alone_m = max(moment.odometry_error_m for moment in moments)
    echo(f"\nOff by {worst_m:.2f} m at most in the outage; the odometry alone: {alone_m:.2f} m.")
    return moments


def _drive(stage: CorridorStage, goal: Pose, moments: list[Moment], echo: _Echo) -> None:
    loop = stage.loop
    begin_us = loop.now_us
    loop.chain.position_input.goal(goal)
    while loop.now_us < begin_us + _LEG_US:
        stage.run_to(loop.now_us + _STEP_US)
        moments.append(_moment(stage))
        if loop.now_us % _ROW_US == 0:
            echo(_row(stage))
        if _arrived(stage, goal):
            return


def _arrived(stage: CorridorStage, goal: Pose) -> bool:
    pose = stage.loop.chain.odometry.pose
    return abs(pose.x - goal.x) < _NEAR_M and abs(pose.y - goal.y) < _NEAR_M


def _moment(stage: CorridorStage) -> Moment:
    loop = stage.loop
    odometry, true = loop.chain.odometry.pose, loop.pose
    alone_m = ((odometry.x - true.x) ** 2 + (odometry.y - true.y) ** 2) ** 0.5
    outage = not stage.service.reachable
    return Moment(loop.now_us / 1e6, outage, stage.error_m, alone_m)


def _row(stage: CorridorStage) -> str:
    counts = stage.lookup(node_manager.SETTLEMENT).cache.counts
    loop = stage.loop
    return (
        f"{loop.now_us / 1e6:6.1f} s {loop.pose.x:6.2f} m {loop.chain.odometry.pose.x:10.2f} m"
        f" {stage.estimate.x_m:10.2f} m {stage.error_m:5.2f} m {counts.hits:6} {counts.stale:5}"
        f" {counts.misses:6} {counts.failures:8}"
    )
