"""Slaves of any stack on one bus, in virtual time, and a host beside them."""

from __future__ import annotations

from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.testing.conformance.slave import Slave
from tickrig.host.canopen.commissioning.node_bus import NodeBus

BOOT_US = 100_000


class NetBench:
    """A bus with slaves; they have booted.

    Attributes:
        wire: the bus.
        rig: makes time pass.
        host: the host's link.
        bus: speaks with the slaves.
        frames: all that was on the bus, as candump writes it.
    """

    def __init__(self, *slaves: Slave, seed: int = 0) -> None:
        self.wire = CanWire(1_000_000, seed)
        self.rig = Rig(*(Station(slave, self.wire.end()) for slave in slaves))
        self.host = CanHost(self.rig, self.wire.end())
        self.bus = NodeBus(self.host)
        self.frames: list[str] = []
        self.wire.observers.append(lambda now_us, frame: self.frames.append(str(frame)))
        self.rig.run_for(BOOT_US)
