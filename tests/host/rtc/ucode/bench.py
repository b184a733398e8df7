"""An emulated reader, a resolution service, and the three components, in virtual time."""

from __future__ import annotations

from tickrig.device.ucode_reader import Marker, UcodeReader
from tickrig.emulators.rig.faults import FaultyPort
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.tkernel.resolution import ResolutionService, SimSource, opener
from tickrig.emulators.tkernel.ucode_table import EXAMPLE, parse_table
from tickrig.host.rtc import InPort, Manager
from tickrig.host.rtc.ports.connect import connect
from tickrig.host.rtc.ucode.contents_interpretation import ContentsInterpretation
from tickrig.host.rtc.ucode.infrared_rays_reader import InfraredRaysReader
from tickrig.host.rtc.ucode.ucode_settlement import UcodeSettlement
from tickrig.wire.rtc_types.rtc import TimedLongSeq, TimedPoint2D, TimedStringSeq
from tickrig.wire.ucode import BAUD

BASE = "http://127.0.0.1:8640"
DOOR = "00001C00000000000001000000000001"
LIFT = "00001C00000000000001000000000002"
NOBODY = "00001C00000000000001000000000009"
SECOND_US = 1_000_000


class UcodeBench:
    """The reader stands at the door and sees it; components run at 100 Hz."""

    def __init__(self, *markers: Marker) -> None:
        self.reader = UcodeReader(markers=markers or (Marker(DOOR, 1, 0), Marker(LIFT, 4, 2.5)))
        self.line = SerialLine(BAUD)
        self.port = FaultyPort(self.line.a, BYTE_FAULTS, seed=1)
        self.rig = Rig(Station(self.reader, self.port))
        self.service = ResolutionService(parse_table(EXAMPLE), BASE)
        self.sources = list[SimSource]()
        self.manager = manager = Manager()
        self.rays = manager.add(InfraredRaysReader("Rays0", lambda name: self.link()), 100)
        self.settlement = manager.add(UcodeSettlement("Settlement0", opener(self.service)), 100)
        self.contents = manager.add(ContentsInterpretation("Contents0", opener(self.service)), 100)
        manager.connect("Rays0.ucodes", "Settlement0.ucodes")
        manager.connect("Settlement0.addresses", "Contents0.addresses")
        self.ucodes = self.probe("Rays0.ucodes", TimedStringSeq)
        self.addresses = self.probe("Settlement0.addresses", TimedStringSeq)
        self.positions = self.probe("Contents0.position", TimedPoint2D)
        self.places = self.probe("Contents0.place", TimedStringSeq)
        self.settled = self.probe("Settlement0.cache", TimedLongSeq)
        manager.activate("Rays0", "Settlement0", "Contents0")

    def link(self) -> SimLink:
        return SimLink(self.rig, self.line.b)

    def probe(self, port: str, kind: type) -> InPort:  # type: ignore[type-arg]
        in_: InPort = InPort("in", kind)  # type: ignore[type-arg]
        connect(self.manager.port(port), in_, {"dataport.buffer.length": "1000"})
        return in_

    def run(self, duration_us: int) -> None:
        until_us = self.manager.now_us + duration_us
        while (due_us := self.manager.due_us) <= until_us:
            self.rig.run_to(due_us)
            self.manager.tick(due_us)

    def go(self, x_m: float, y_m: float, heading_rad: float = 0.0) -> None:
        for name, value in zip(("x_m", "y_m", "heading_rad"), (x_m, y_m, heading_rad), strict=True):
            self.reader.inputs.set(name, value)


def values(port: InPort) -> list:  # type: ignore[type-arg]
    """Take all that a probe has."""
    found = []
    while port.is_new:
        found.append(port.read())
    return found
