"""The outside ends of an emulated bench: ptys, TCP ports, and buses of python-can."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from typing import TYPE_CHECKING, Final

from tickrig.emulators.rig.port import OutsideBridge
from tickrig.emulators.serial.bridge import Bridge
from tickrig.emulators.serial.network.network_port import NetworkPort
from tickrig.emulators.serial.network.serve_url import parse_serve_url
from tickrig.emulators.serial.serial_hub import SerialHub
from tickrig.emulators.testing.bench.modes.real.doors import LinePlace
from tickrig.emulators.testing.bench.mounts import BusMount, LineMount, Mount
from tickrig.emulators.testing.rig_file.plan import BusPlan, DoorPlan, RealPlan
from tickrig.host.control.clock import ServingClock

if TYPE_CHECKING:
    from pathlib import Path

    from tickrig.emulators.serial.pty_port import PtyPort

IN_PROCESS: Final = "virtual"
"""The bus of python-can that has both ends in one process."""

WITHOUT_PTYS: Final = "socket://0"
"""Where a line is on a system without ptys, for this machine alone."""


class Outside:
    """Where hosts find the wires of a bench in real time.

    A serial line is at a pty, on a system without ptys at a TCP port, and at what it is served by
    too. A CAN bus is joined with one of
    python-can: unless told otherwise one in this process, on a channel of its own.

    Args:
        mounts: the wires.
        plan: where they are to be.

    Attributes:
        clock: of the rig.
        bridges: between the wires and the outside, for the rig.
        places: where hosts of this process come in, by the name of the wire.
        ports: of the lines, by the name of the wire.

    Raises:
        BusGone: a bus cannot be opened.
        OSError: no port is to be had, or no link can be made.
    """

    def __init__(self, mounts: Iterable[Mount], plan: RealPlan | None = None) -> None:
        doors = {} if plan is None else plan.doors
        self.clock, self._stack = ServingClock(), ExitStack()
        self.bridges: list[OutsideBridge] = []
        self.places: dict[str, LinePlace | BusPlan] = {}
        self.ports: dict[str, list[PtyPort | NetworkPort]] = {}
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
        self.bridges.append(Bridge(mount.line.b, hub, hub.attend))
        url = own.url if isinstance(own, NetworkPort) else own.path
        self.places[mount.name] = LinePlace(url, mount.settings.baud)

    def _own_port(self, link: Path | None) -> PtyPort | NetworkPort:
        """Open the port for hosts of this process: a TCP port where there are no ptys."""
        try:
            from tickrig.emulators.serial.pty_port import PtyPort  # noqa: PLC0415 - POSIX has ptys
        except ImportError:
            return self._serve(WITHOUT_PTYS)
        pty = PtyPort(link)
        self._stack.callback(pty.close)
        return pty

    def _serve(self, url: str) -> NetworkPort:
        port = NetworkPort(parse_serve_url(url))
        self._stack.callback(port.close)
        return port

    def _open_bus(self, mount: BusMount, plan: BusPlan) -> None:
        from tickrig.emulators.can.outside.bridge import CanBridge  # noqa: PLC0415 - slow
        from tickrig.emulators.can.outside.bus_port import port_on  # noqa: PLC0415 - slow
        from tickrig.emulators.testing.bench.modes.real.watched_bus import (  # noqa: PLC0415
            name_of,
            open_bus,
        )
        from tickrig.emulators.testing.bench.modes.real.watched_link import LinkGone  # noqa: PLC0415
        from tickrig.host.links.can_link import close_bus  # noqa: PLC0415 - slow

        bus = open_bus(plan, {})
        self._stack.callback(close_bus, bus)
        port = port_on(bus, plan.interface, name_of(plan), LinkGone)
        self.bridges.append(CanBridge(mount.open_end(), port))
        self.places[mount.name] = plan

    def close(self) -> None:
        """Give everything back."""
        self._stack.close()


def _own_bus(mount: BusMount) -> BusPlan:
    """Return a bus that nobody else has."""
    return BusPlan(interface=IN_PROCESS, channel=f"{mount.name} {id(mount)}")
