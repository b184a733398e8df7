"""Fig. 120: a potentiometer turns a motor, by PDO link without a PC, then by ports through it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from tickrig import open_bench
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
    server = RtcCanopenServer(definition, read_files(definition, HERE / "rtc_canopen"))
    with open_bench(HERE / "rigs" / "fig120.toml") as bench:
        link: Any = bench.link
        serve(server, link, 1_000_000)
        bench["palette"].set("ai1_v", 2.5)
        if pc:
            serve(server, link, 2_000_000)
        bench.run_for(2_000_000 - bench.now_us)
        return float(bench["motor"].get("angle_deg"))


if __name__ == "__main__":
    for text, pc in (("by PDO link, the PC gone", False), ("by ports through the PC", True)):
        print(f"{text}: {turn(pc=pc):.2f} deg")
