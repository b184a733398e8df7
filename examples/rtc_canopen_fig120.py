"""Fig. 120: a potentiometer turns a motor, by PDO link without a PC, then by ports through it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from tickrig import CanWire
from tickrig.emulators.can.outside.host import CanHost  # internal
from tickrig.emulators.canopen.build import describe_nodes, make_bench, make_nodes  # internal
from tickrig.emulators.canopen.rig_file import read_rig  # internal
from tickrig.host.rtc.canopen.definition import RtConnection  # internal
from tickrig.host.rtc.canopen.definition_reader import read_definition  # internal
from tickrig.host.rtc.canopen.serve import read_files, serve  # internal
from tickrig.host.rtc.canopen.server import RtcCanopenServer  # internal

HERE = Path(__file__).parent


def turn(*, pc: bool) -> float:
    """Set the two up, turn the potentiometer, and return where the motor is."""
    definition = read_definition(HERE / "rtc_canopen" / "fig120.yaml")
    if pc:
        ports = (RtConnection("Palette0.ai", "Motor0.angle"),)
        definition = replace(definition, pdo_links=(), rt_connections=ports)
    nodes = describe_nodes(read_rig(HERE / "rigs" / "fig120.toml").nodes)
    bench = make_bench(wire := CanWire(), make_nodes(nodes, wire))
    server = RtcCanopenServer(definition, read_files(definition, HERE / "rtc_canopen"))
    serve(server, link := CanHost(bench.rig, wire.end()), 1_000_000)
    bench.operator.set("16/ai1_v", 2.5)
    if pc:
        serve(server, link, 2_000_000)
    bench.rig.run_to(2_000_000)
    return float(bench.device.read("32/angle_deg"))


if __name__ == "__main__":
    for text, pc in (("by PDO link, the PC gone", False), ("by ports through the PC", True)):
        print(f"{text}: {turn(pc=pc):.2f} deg")
