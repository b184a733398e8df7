"""R1, the reference slave, on a rig in virtual time, and what names stand for on it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from tests.device.canopen.profile_objects import make_dictionary
from tests.device.canopen.reference import NODE_ID
from tickrig.device.canopen.core.application import Application
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig, Station
from tickrig.host.canopen.conform.notation.names import Address, Unbound


class R1:
    """R1 and its bus.

    Attributes:
        link: the host's end of the bus.
    """

    def __init__(
        self, needs: Iterable[str] = (), application: type[Application] = Application
    ) -> None:
        self.slave: CanopenSlave = make_slave(
            make_dictionary(frozenset(needs)), NODE_ID, application=application
        )
        wire = CanWire()
        self.rig = Rig(Station(self.slave, wire.end()))
        self.link = CanHost(self.rig, wire.end())
        self.rig.run_for(100_000)


class R1Names:
    """The names of the communication profile on node 5."""

    TEXTS: Final = {
        ("node", ""): "05",
        ("request", ""): "605",
        ("response", ""): "585",
        ("heartbeat", ""): "705",
        ("emcy", ""): "085",
    }

    def text(self, name: str, attribute: str) -> str:
        try:
            return self.TEXTS[name, attribute]
        except KeyError:
            raise Unbound(name, "not of the table of R1") from None

    def address(self, name: str) -> Address:
        raise Unbound(name, "not of the table of R1")
