"""The doors that hosts come in by: ports and buses of this machine."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.bench.modes.mode import Address
from tickrig.emulators.testing.bench.modes.real.door_watch import DoorWatch
from tickrig.emulators.testing.bench.modes.real.watched_link import (
    LinkGone,
    WatchedFrameLink,
    WatchedLink,
)
from tickrig.emulators.testing.rig_file.plan import BusPlan
from tickrig.host.links.errors import LinkClosed
from tickrig.host.text.trace import Mark

if TYPE_CHECKING:
    import can
    import canopen
    import serial

    from tickrig.host.links.link import Link, StampedLink

NOTIFIER_S: Final = 0.1
"""How often the canopen library looks whether it is to end."""


@dataclass(frozen=True, slots=True)
class LinePlace:
    """Where a serial line is.

    Attributes:
        url: device path, or URL of pyserial.
        baud: in bit/s.
        framing: data bits, parity, stop bits.
    """

    url: str
    baud: int = 115_200
    framing: str = "8N1"


class Doors:
    """Opens doors for hosts; what a host leaves open is closed with them.

    Args:
        places: where the wires are, by name.
        watch_of: returns who watches the doors of a wire.
    """

    def __init__(
        self, places: Mapping[str, LinePlace | BusPlan], watch_of: Callable[[str], DoorWatch]
    ) -> None:
        self._places, self._watch_of = places, watch_of
        self._opened = ExitStack()

    def link(self, wire: str) -> Link[Any]:
        """Connect a link; see `BenchMode`."""
        place, watch = self._place(wire), self._watch_of(wire)
        link: WatchedLink[Any]
        if isinstance(place, BusPlan):
            link = WatchedFrameLink(_frame_link(place, watch), watch)
        else:
            link = WatchedLink(_line_link(place), watch)
        self._opened.callback(link.close)
        return link

    def serial(self, wire: str, options: dict[str, Any]) -> serial.SerialBase:
        """Open a line by pyserial; see `BenchMode`."""
        from tickrig.emulators.testing.bench.modes.real.watched_serial import (  # noqa: PLC0415 - slow
            open_watched,
        )

        place = self._place(wire)
        if isinstance(place, BusPlan):
            raise ValueError(f"{wire} is a CAN bus, not a serial line")
        data, parity, stop = int(place.framing[0]), place.framing[1], float(place.framing[2:])
        own = {"baudrate": place.baud, "bytesize": data, "parity": parity, "stopbits": stop}
        locked = {"exclusive": True}  # a second host takes bytes away from the first
        port = open_watched(place.url, self._watch_of(wire), {**own, **locked, **options})
        self._opened.callback(port.close)
        return port

    def can_bus(self, wire: str, options: dict[str, Any]) -> can.BusABC:
        """Open a bus by python-can; see `BenchMode`."""
        from tickrig.emulators.testing.bench.modes.real.watched_bus import (  # noqa: PLC0415 - slow
            open_watched,
        )
        from tickrig.host.links.can_link import close_bus  # noqa: PLC0415 - slow

        bus = open_watched(self._bus(wire), self._watch_of(wire), options)
        self._opened.callback(close_bus, bus)
        return bus

    def canopen_network(self, wire: str) -> canopen.Network:
        """Connect the canopen library to a bus; see `BenchMode`."""
        import canopen  # noqa: PLC0415 - slow

        network = canopen.Network(self.can_bus(wire, {}))
        network.NOTIFIER_CYCLE = NOTIFIER_S
        self._opened.callback(network.disconnect)
        return network.connect()

    def address(self, wire: str) -> Address:
        """Return where a program opens a wire by itself; see `BenchMode`."""
        place = self._places[wire]
        if isinstance(place, LinePlace):
            return place.url
        rate = {} if place.bit_rate is None else {"bitrate": place.bit_rate}
        return {"interface": place.interface, "channel": place.channel, **rate, **place.options}

    def close(self) -> None:
        """Close what is still open."""
        self._opened.close()

    def _place(self, wire: str) -> LinePlace | BusPlan:
        if wire not in self._places:
            raise NotOnThisBench(f"nobody has said where {wire} is")
        return self._places[wire]

    def _bus(self, wire: str) -> BusPlan:
        place = self._place(wire)
        if isinstance(place, LinePlace):
            raise ValueError(f"{wire} is a serial line, not a CAN bus")
        return place


def _line_link(place: LinePlace) -> Link[bytes]:
    from tickrig.host.links.serial_link import SerialLink  # noqa: PLC0415 - pyserial is slow

    try:
        return SerialLink(place.url, place.baud)
    except LinkClosed as error:
        raise LinkGone(str(error)) from error


def _frame_link(place: BusPlan, watch: DoorWatch) -> StampedLink:
    from tickrig.emulators.testing.bench.modes.real.watched_bus import (  # noqa: PLC0415 - slow
        name_of,
        open_bus,
    )
    from tickrig.host.links.can_link import CanLink  # noqa: PLC0415 - slow
    from tickrig.host.links.echo import free_of_echo  # noqa: PLC0415 - with it

    link = CanLink(open_bus(place, {}), name_of(place))
    link.on_error_frame = lambda frame: watch.passed(Mark.FROM_DEVICE, (frame,))
    return free_of_echo(link, place.interface)
