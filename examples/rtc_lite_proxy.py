"""An RTC-Lite device in a system of RT components, in virtual time; then its power is cut."""

from __future__ import annotations

from tickrig import Rig, SerialLine, SimLink, Station
from tickrig.device import RtcLiteNode
from tickrig.device.rtc_lite.component import LiteEcho  # internal
from tickrig.emulators.rig.sim_link import RigClock  # internal
from tickrig.host.rtc.components import ConsoleIn, ConsoleOut  # internal
from tickrig.host.rtc.lite import attach  # internal
from tickrig.host.rtc.system.schedule import RealTime  # internal
from tickrig.rtc import Manager


def main() -> None:
    """Send three numbers through the device."""
    line, node = SerialLine(57_600), RtcLiteNode(LiteEcho)
    rig, manager = Rig(Station(node, line.a)), Manager()
    runner = RealTime(manager, RigClock(rig))
    source = manager.add(ConsoleIn("ConsoleIn0"), rate_hz=10.0)
    attach(manager, SimLink(rig, line.b), "Echo", listener=print)  # or a SerialLink("/dev/ttyUSB0")
    sink = manager.add(ConsoleOut("ConsoleOut0"), rate_hz=10.0)
    manager.connect("ConsoleIn0.out", "Echo0.in")
    manager.connect("Echo0.out", "ConsoleOut0.in")
    manager.activate("ConsoleIn0", "Echo0", "ConsoleOut0")
    source.enter(1, -5, 2_147_483_647)
    while rig.now_us < 1_000_000:
        runner.step()
    print(*(value.data for value in sink.received))
    node.inputs.set("power_cut", 1)
    while "Echo0.rtc" in manager.names.names("localhost"):
        runner.step()


if __name__ == "__main__":
    main()
