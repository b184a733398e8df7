"""A client with an emulated sensor, in virtual time."""

from __future__ import annotations

from tickrig.device.urg.sensor import Urg
from tickrig.device.urg.world import World, room
from tickrig.emulators.rig.faults import FaultyPort
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.urg import UrgClient, UrgScan


class SensorBench:
    """The client polls every 10 ms."""

    def __init__(self, world: World | None = None, cluster: int = 1, interval: int = 0) -> None:
        self.urg, self.line = Urg(world=world or room(4, 3)), SerialLine(12_000_000)
        self.port = FaultyPort(self.line.a, BYTE_FAULTS, seed=1)
        self.rig = Rig(Station(self.urg, self.port))
        self.link = SimLink(self.rig, self.line.b)
        self.client = UrgClient(self.link, cluster, interval)

    def run(self, duration_ms: int = 1_000) -> list[UrgScan]:
        scans = []
        for _ in range(duration_ms // 10):
            self.rig.run_for(10_000)
            scans += self.client.poll()
        return scans
