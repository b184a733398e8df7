"""Fig. 120: a potentiometer turns a motor, by PDO link without a PC, then by ports through it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.bench import make_bench
from tickrig.emulators.canopen.build import describe_nodes, make_nodes
from tickrig.emulators.canopen.rig_file import read_rig
from tickrig.host.rtc_canopen.definition.definition import RtConnection, SystemDefinition
from tickrig.host.rtc_canopen.definition.definition_reader import read_definition
from tickrig.host.rtc_canopen.serve import read_files, serve
from tickrig.host.rtc_canopen.server import Server

HERE = Path(__file__).parent
BY_LINK = read_definition(HERE / "rtc_canopen" / "fig120.yaml")
THROUGH_PC = (RtConnection("Palette0.ai", "Motor0.angle"),)
BY_PORTS = replace(BY_LINK, pdo_links=(), rt_connections=THROUGH_PC)


def turn(definition: SystemDefinition, *, pc: bool) -> float:
    """Set the two up, turn the potentiometer, and return where the motor is."""
    wire, nodes = CanWire(), describe_nodes(read_rig(HERE / "rigs" / "fig120.toml").nodes)
    bench = make_bench(wire, make_nodes(nodes, wire))
    server = Server(definition, read_files(definition, HERE / "rtc_canopen"))
    serve(server, link := CanHost(bench.rig, wire.end()), 1_000_000)
    bench.operator.set("16/ai1_v", 2.5)
    if pc:
        serve(server, link, 2_000_000)
    else:
        bench.rig.run_for(1_000_000)
    return float(bench.device.read("32/angle_deg"))


if __name__ == "__main__":
    print(f"by PDO link, the PC gone: {turn(BY_LINK, pc=False):.2f} deg")
    print(f"by ports through the PC: {turn(BY_PORTS, pc=True):.2f} deg")
