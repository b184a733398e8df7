"""The outside ends of an emulated bench: ptys, TCP ports, and buses of python-can."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from tickrig._lazy import LazyModule
from tickrig.emulators.rig.port import OutsideBridge
from tickrig.emulators.serial.bridge import Bridge
from tickrig.emulators.serial.emulator import SerialHub
from tickrig.emulators.serial.network import NetworkPort, parse_serve_url
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.bench.modes import door_watch
from tickrig.emulators.testing.bench.modes.mode import Address
from tickrig.emulators.testing.bench.mounts import BusMount, LineMount, Mount
from tickrig.emulators.testing.rig_file.plan import BusPlan, DoorPlan, RealPlan
from tickrig.host.control.clock import ServingClock
from tickrig.host.links.link import LinkClosed
from tickrig.host.links.serial_link import SerialLink

if TYPE_CHECKING:
    from pathlib import Path

    import can
    import canopen
    import serial

    from tickrig.emulators.serial import pty_port
    from tickrig.emulators.testing.bench.modes import bus_doors
    from tickrig.host.links import can_link
    from tickrig.host.links.link import Link
else:
    pty_port = LazyModule("tickrig.emulators.serial.pty_port")  # POSIX
    # python-can takes longer to import than all the rest of a bench
    bus_doors = LazyModule("tickrig.emulators.testing.bench.modes.bus_doors")
    can_link = LazyModule("tickrig.host.links.can_link")

# The connections for hosts: ports and buses of this machine.

_NOTIFIER_S: Final = 0.1
"""Period at which the canopen library checks whether to stop."""


@dataclass(frozen=True, slots=True)
class LinePlace:
    """Address of a serial line, at which a host opens it.

    Attributes:
        url: device path, or URL of pyserial.
        baud: baud rate in bit/s.
        framing: data bits, parity and stop bits.
    """

    url: str
    baud: int = 115_200
    framing: str = "8N1"


class Doors:
    """Opens the wires of a bench in real time for hosts: as links, pyserial ports and CAN buses.

    The method `close` also closes connections that hosts have left open.

    Args:
        places: addresses of the wires, by name.
        watch_of: function that returns the monitor for the connections of a wire.
        begin: function that starts the time of the bench; it is called when a connection is opened.
    """

    def __init__(
        self,
        places: Mapping[str, LinePlace | BusPlan],
        watch_of: Callable[[str], door_watch.HostPace],
        begin: Callable[[], None],
    ) -> None:
        self._places, self._watch_of, self._begin = places, watch_of, begin
        self._opened = ExitStack()

    def link(self, wire: str) -> Link[Any]:
        """Connect a link."""
        place, watch = self._place(wire), self._watch_of(wire)
        link: door_watch.WatchedLink[Any]
        if isinstance(place, BusPlan):
            link = door_watch.WatchedFrameLink(bus_doors.frame_link(place, watch), watch)
        else:
            link = door_watch.WatchedLink(_line_link(place), watch)
        self._opened.callback(link.close)
        self._begin()
        return link

    def serial(self, wire: str, options: dict[str, Any]) -> serial.SerialBase:
        """Open a line by pyserial."""
        place = self._place(wire)
        if isinstance(place, BusPlan):
            raise ValueError(f"{wire} is a CAN bus, not a serial line")
        data, parity, stop = int(place.framing[0]), place.framing[1], float(place.framing[2:])
        own = {"baudrate": place.baud, "bytesize": data, "parity": parity, "stopbits": stop}
        locked = {"exclusive": True}  # a second host takes bytes away from the first
        port = door_watch.open_watched_serial(
            place.url, self._watch_of(wire), {**own, **locked, **options}
        )
        self._opened.callback(port.close)
        self._begin()
        return port

    def can_bus(self, wire: str, options: dict[str, Any]) -> can.BusABC:
        """Open a bus by python-can."""
        bus = self._open_bus(wire, options)
        self._begin()
        return bus

    def _open_bus(self, wire: str, options: dict[str, Any]) -> can.BusABC:
        bus = bus_doors.open_watched_bus(self._bus(wire), self._watch_of(wire), options)
        self._opened.callback(can_link.close_bus, bus)
        return bus

    def canopen_network(self, wire: str) -> canopen.Network:
        """Connect the canopen library to a bus."""
        import canopen  # noqa: PLC0415 - slow

        network = canopen.Network(self._open_bus(wire, {}))
        network.NOTIFIER_CYCLE = _NOTIFIER_S
        self._opened.callback(network.disconnect)
        network.connect()
        self._begin()
        return network

    def address(self, wire: str) -> Address:
        """Return the address at which a program can open a wire itself."""
        place = self._places[wire]
        self._begin()
        if isinstance(place, LinePlace):
            return place.url
        rate = {} if place.bit_rate is None else {"bitrate": place.bit_rate}
        return {"interface": place.interface, "channel": place.channel, **rate, **place.options}

    def close(self) -> None:
        """Close everything still open."""
        self._opened.close()

    def _place(self, wire: str) -> LinePlace | BusPlan:
        if wire not in self._places:
            raise NotOnThisBench(f"no address of {wire} is given")
        return self._places[wire]

    def _bus(self, wire: str) -> BusPlan:
        place = self._place(wire)
        if isinstance(place, LinePlace):
            raise ValueError(f"{wire} is a serial line, not a CAN bus")
        return place


def _line_link(place: LinePlace) -> Link[bytes]:
    try:
        return SerialLink(place.url, place.baud)
    except LinkClosed as error:
        raise door_watch.LinkGone(str(error)) from error


_IN_PROCESS: Final = "virtual"
"""The bus of python-can that has both ends in one process."""

_WITHOUT_PTYS: Final = "socket://0"
"""Address of a line on a system without ptys, for this machine only."""


class OutsideEnds:
    """Addresses of the wires of a bench in real time.

    A serial line is at a pty and at the addresses in `serve`. On a system without ptys, a TCP port
    replaces the pty. A CAN bus is connected with a python-can bus; by default the python-can bus is
    in this process, on its own channel.

    Args:
        mounts: the wires.
        plan: addresses of the wires.

    Attributes:
        clock: clock of the rig.
        bridges: bridges between the wires and the outside, for the rig.
        places: addresses for hosts in this process, by name of the wire.
        ports: ports of the lines, by name of the wire.

    Raises:
        BusGone: a bus cannot be opened.
        OSError: no port is free, or a link cannot be made.
    """

    def __init__(self, mounts: Iterable[Mount], plan: RealPlan | None = None) -> None:
        doors = {} if plan is None else plan.doors
        self.clock, self._stack = ServingClock(), ExitStack()
        self.bridges: list[OutsideBridge] = []
        self.places: dict[str, LinePlace | BusPlan] = {}
        self.ports: dict[str, list[pty_port.PtyPort | NetworkPort]] = {}
        with ExitStack() as undo:
            undo.callback(self.close)
            for mount in mounts:
                door = doors.get(mount.name, DoorPlan())
                if isinstance(mount, LineMount):
                    self._open_line(mount, door)
                else:
                    self._open_bus(mount, door.bus or _own_bus(mount))
            undo.pop_all()

    def _open_line(self, mount: LineMount, door: DoorPlan) -> None:
        own = self._own_port(door.link)
        served = [self._serve(url) for url in door.serve]
        self.ports[mount.name] = [own, *served]
        hub = SerialHub([own, *served])
        changed = hub.device_uses if mount.settings.uart else None
        self.bridges.append(Bridge(mount.line.b, hub, hub.attend, changed))
        url = own.url if isinstance(own, NetworkPort) else own.path
        self.places[mount.name] = LinePlace(url, mount.settings.baud)

    def _own_port(self, link: Path | None) -> pty_port.PtyPort | NetworkPort:
        """Open the port for hosts of this process: a pty, or a TCP port if there are no ptys."""
        try:
            pty = pty_port.PtyPort(link)
        except ImportError:
            return self._serve(_WITHOUT_PTYS)
        self._stack.callback(pty.close)
        return pty

    def _serve(self, url: str) -> NetworkPort:
        port = NetworkPort(parse_serve_url(url))
        self._stack.callback(port.close)
        return port

    def _open_bus(self, mount: BusMount, plan: BusPlan) -> None:
        self.bridges.append(bus_doors.join_bus(mount, plan, self._stack))
        self.places[mount.name] = plan

    def close(self) -> None:
        """Release all resources."""
        self._stack.close()


def _own_bus(mount: BusMount) -> BusPlan:
    """Return a bus in this process, on its own channel."""
    return BusPlan(interface=_IN_PROCESS, channel=f"{mount.name} {id(mount)}")
