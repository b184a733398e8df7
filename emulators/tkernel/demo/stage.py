"""The stage: a cart in a corridor with markers, the node that it carries, the service."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any, Final

from tickrig.device.rh3.base import LOOK_US, Rh3Base
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.device.ucode_reader.markers import Marker
from tickrig.device.ucode_reader.reader import UcodeReader
from tickrig.emulators.rh3.cart.closed_loop import ClosedLoop
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.tkernel.demo.estimate import Estimate
from tickrig.emulators.tkernel.node.applications import (
    CONTENTS,
    READER,
    SETTLEMENT,
    BoardLines,
    add_position_detection,
)
from tickrig.emulators.tkernel.node.board import Board
from tickrig.emulators.tkernel.node.limits import NodeLimits
from tickrig.emulators.tkernel.node.node_manager import NodeManager
from tickrig.emulators.tkernel.resolution.service import ResolutionService
from tickrig.emulators.tkernel.resolution.sim_source import opener
from tickrig.emulators.tkernel.resolution.table import Table
from tickrig.host.rtc import InPort
from tickrig.host.rtc.ports.connect import connect
from tickrig.host.rtc.ucode.lookup import Lookup
from tickrig.wire.instant import NEVER
from tickrig.wire.rtc_types.basic import TimedLongSeq, TimedStringSeq
from tickrig.wire.rtc_types.extended_2d import TimedPoint2D
from tickrig.wire.sensors.ucode import BAUD

LENGTH_M: Final = 8.0
"""The way of the cart along the corridor."""

BACK_M: Final = 3.0
"""Where it comes back to: further on are markers that it has not seen before."""

SPACING_M: Final = 2.0
ASIDE_M: Final = 1.0
"""How far the markers are beside that way."""

WORN: Final = 1.12
"""Wheels and tread are 12 % more than the odometry knows: it errs on the way, not when turning."""

BASE: Final = "http://127.0.0.1:8640"
_WIDE: Final = {"dataport.buffer.length": "64"}
_PLACE: Final = ("x_m", "y_m", "heading_rad")


def corridor() -> tuple[tuple[Marker, ...], Table]:
    """Return markers each 2 m, on both sides in turn, and what is known of them."""
    places = [(SPACING_M * number, -ASIDE_M if number % 2 else ASIDE_M) for number in range(-1, 7)]
    ucodes = [f"00001C{0:016X}{number:010X}" for number in range(1, len(places) + 1)]
    markers = tuple(Marker(ucode, *place) for ucode, place in zip(ucodes, places, strict=True))
    names = [f"place-{number}" for number in range(1, len(places) + 1)]
    contents = {
        name: f'{{"x_m": {x}, "y_m": {y}}}' for name, (x, y) in zip(names, places, strict=True)
    }
    return markers, Table(dict(zip(ucodes, names, strict=True)), contents)


class MountedReader:
    """A reader in the middle of the axle, as a coupling of the rig.

    Args:
        base: what carries it.
        markers: what is around.

    Attributes:
        reader: it.
        line: its line; `b` is the host's end.
        station: it, on its line.
    """

    def __init__(self, base: Rh3Base, markers: tuple[Marker, ...]) -> None:
        self._base, self.reader, self.line = base, UcodeReader(markers=markers), SerialLine(BAUD)
        self.station: Station[bytes] = Station(self.reader, self.line.a)

    @property
    def tick_us(self) -> int:
        """As often as the world looks at the base."""
        return LOOK_US

    @property
    def due_us(self) -> int:
        """Never: a base that moves has work."""
        return NEVER

    def act(self, now_us: int, /) -> None:
        """Put the reader where the base has taken it."""
        for name in _PLACE:
            if self.reader.inputs[name] != (value := self._base.read(name)):
                self.reader.inputs.set(name, value)


class Stage:
    """Everything in virtual time.

    Args:
        caches: whether entries of the caches outlive an outage.

    Attributes:
        service: of ucodes.
        board: of the node.
        loop: the cart.
        estimate: where it believes to be.
    """

    def __init__(self, *, caches: bool = True) -> None:
        markers, table = corridor()
        self.service, self._caches = ResolutionService(table, BASE), caches
        base = BaseParameters()
        worn = BaseParameters(
            radius_left_m=base.radius_left_m * WORN,
            radius_right_m=base.radius_right_m * WORN,
            tread_m=base.tread_m * WORN,
        )
        self.loop = ClosedLoop(worn, aboard=lambda base: self._mount(base, markers))
        self.estimate = Estimate(self._mounted.reader.parameters.range_m)
        lines = BoardLines(self._open, self._open, opener(self.service))
        self._lines, self.board = lines, Board(NodeLimits(), self._start, lines)
        self.loop.manager.add_item(self.board)
        self._odometry = self.loop.chain.odometry.pose
        self._probes: list[InPort[Any]] = []
        self._round: dict[str, int] = {}

    @property
    def error_m(self) -> float:
        """How far off it believes to be."""
        return self.estimate.error_m(self.loop.pose.x, self.loop.pose.y)

    def lookup(self, name: str) -> Lookup[Any]:
        """Return a component of the node that has a cache."""
        assert self.board.manager is not None
        component = self.board.manager.find(name)
        assert isinstance(component, Lookup)
        return component

    def run_to(self, t_us: int) -> None:
        """Go on to a time, and believe what was learned."""
        self.loop.run_to(t_us)
        pose = self.loop.chain.odometry.pose
        self.estimate.move(pose.x - self._odometry.x, pose.y - self._odometry.y)
        self._odometry = pose
        if self._probes:
            self._fix()

    def _fix(self) -> None:
        """Believe the places that were found; a place is that of the latest round."""
        ucodes, levels, places, points = self._probes
        for found, levels_pct in zip(_taken(ucodes), _taken(levels), strict=True):
            self._round = dict(zip(found.data, levels_pct.data, strict=True))
        for place, point in zip(_taken(places), _taken(points), strict=True):
            if (level := self._round.get(place.data[0])) is not None:
                self.estimate.fix(point.data.x, point.data.y, level)

    def _mount(self, base: Rh3Base, markers: tuple[Marker, ...]) -> MountedReader:
        self._mounted = MountedReader(base, markers)
        return self._mounted

    def _open(self, name: str) -> SimLink:
        return SimLink(self.loop.rig, self._mounted.line.b)

    def _start(self, manager: NodeManager, stack: ExitStack) -> None:
        add_position_detection(manager, self._lines, "", BASE)
        for name in (SETTLEMENT, CONTENTS):
            configuration = manager.find(name).configuration
            configuration.set("fresh", "5")
            if not self._caches:
                configuration.set("keep", "5")
        wanted: dict[str, type] = {
            f"{READER}.ucodes": TimedStringSeq,
            f"{READER}.levels": TimedLongSeq,
            f"{CONTENTS}.place": TimedStringSeq,
            f"{CONTENTS}.position": TimedPoint2D,
        }
        self._probes = [InPort("in", kind) for kind in wanted.values()]
        for name, probe in zip(wanted, self._probes, strict=True):
            connect(manager.port(name), probe, _WIDE)


def _taken(port: InPort[Any]) -> list[Any]:
    """Take all new values of a port."""
    taken = []
    while port.is_new:
        taken.append(port.read())
    return taken
