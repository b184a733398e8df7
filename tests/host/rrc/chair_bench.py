"""A chair under a guard, in virtual time."""

from __future__ import annotations

from tests.host.spy_link import SpyLink
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.rrc.chair import Chair, Guard


class Bench:
    """An RRC whose VR2 runs, and the chair of a host."""

    def __init__(self, guard: Guard | None = None, *, on: bool = True) -> None:
        line, self.rrc = SerialLine(), Rrc()
        self.rig = Rig(Station(self.rrc, line.a))
        if on:
            self.press_power()
        self.link = SpyLink(SimLink(self.rig, line.b))
        self.chair = Chair(self.link, guard or Guard())

    def press_power(self) -> None:
        for pressed in (0, 1, 0):
            self.rrc.inputs.set("power_button", pressed)
            self.rig.run_for(400_000)

    def out_pct(self) -> tuple[int | str, int | str]:
        return self.rrc.read("out_v_pct"), self.rrc.read("out_w_pct")
