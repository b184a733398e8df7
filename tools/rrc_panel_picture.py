"""Draw a panel into an SVG file, from a run in virtual time.

`python tools/rrc_panel_picture.py docs/pictures/rrc-panel.svg` draws `rrc-emu --panel`,
with `rrc-host-panel.svg` it draws `rrc URL --panel`.
"""

from __future__ import annotations

import asyncio
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.bench.running_emulator import Transcript
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.rrc.panel import RrcPanel
from tickrig.emulators.scenario import ScenarioParser, ScenarioPlayer
from tickrig.emulators.serial.emulator import Emulator
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.control.requests import Object
from tickrig.host.rrc.chair import Chair, Guard
from tickrig.host.rrc.panel import ChairPanel
from tickrig.host.rrc.pilot import Pilot

FONTS: Final = re.compile(r"\s*@font-face \{.*?\}", re.DOTALL)
"""Textual names fonts of another site; without them a reader's own are taken."""

SCENARIO = """
0.5  press power_button
1    send watchdog64
1.2  send limit3232ffffff
1.3  send statusA1
+10ms send hello
1.5  set stick 80 -30
+0s  press speed_up_button for 1s
1.6  send beep646464640a0a0a0a0a0a
2    end
"""


def picture() -> str:
    """Return the panel as SVG, at the end of `SCENARIO`."""
    emulator = Emulator("rrc", Rrc(), link="/tmp/rrc")
    scenario = ScenarioParser(emulator.device, emulator.operator).parse(SCENARIO, "")
    ScenarioPlayer(emulator, scenario, Transcript(emulator, lambda line: None))
    while emulator.running:
        emulator.step()
    return asyncio.run(_draw(EmulatorControl(emulator)))


async def _draw(control: EmulatorControl) -> str:
    async def ask(requests: Sequence[Object]) -> list[Object]:
        return [control.answer(request) for request in requests]

    panel = RrcPanel(ask)
    async with panel.run_test(size=(80, 24)) as pilot:
        await pilot.pause()
        await panel.look()
        await pilot.pause()
        return FONTS.sub("", panel.export_screenshot(title="rrc-emu --panel"))


def host_picture() -> str:
    """Return the host's panel as SVG, while the host drives forward and to the left."""
    line, rrc = SerialLine(), Rrc()
    rig = Rig(Station(rrc, line.a))
    for pressed in (0, 1, 0):
        rrc.inputs.set("power_button", pressed)
        rig.run_for(400_000)
    rrc.inputs.set("stick_v_pct", 15)
    with Chair(SimLink(rig, line.b), Guard()) as chair:
        return asyncio.run(_draw_host(Pilot(chair), rig))


async def _draw_host(pilot: Pilot, rig: Rig) -> str:
    panel = ChairPanel(pilot, "/dev/ttyACM0")
    async with panel.run_test(size=(80, 24)) as keys:
        await keys.press("2", "h", "up", "up", "up", "up", "left", "left", "space")
        until_us = rig.now_us + 500_000
        while rig.now_us < until_us:
            pilot.step()
        panel.look()
        await keys.pause()
        return FONTS.sub("", panel.export_screenshot(title="rrc /dev/ttyACM0 --panel"))


PICTURES: Final = {"rrc-panel": picture, "rrc-host-panel": host_picture}

if __name__ == "__main__":
    path = Path(sys.argv[1])
    path.write_text(PICTURES[path.stem](), "utf-8")
