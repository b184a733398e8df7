"""Plans of benches of real devices, as rig files say them, and who answers at the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tickrig.emulators.testing.bench.modes.operators import Terminal
from tickrig.emulators.testing.rig_file.plan import (
    DeviceKind,
    DevicePlan,
    HardwarePlan,
    PortPlan,
    RigPlan,
    WirePlan,
)


class Answers(Terminal):
    """A human who answers in turn.

    Attributes:
        asked: what was asked.
    """

    def __init__(self, *answers: str) -> None:
        super().__init__()
        self._answers, self.asked = list(answers), list[str]()

    def answer(self, *answers: str) -> None:
        """Answer so after what was said before."""
        self._answers += answers

    def prompt(self, text: str) -> str:
        self.asked.append(text)
        return self._answers.pop(0)


def serial_plan(hardware: HardwarePlan, devices: Sequence[str] = ("rrc",)) -> RigPlan:
    """Devices on lines of their own, each called as its type."""
    return RigPlan(
        wires={name: WirePlan(name=name, given=False) for name in devices},
        devices={
            name: DevicePlan(name=name, kind=DeviceKind.SERIAL, type=name, wire=name)
            for name in devices
        },
        hardware=hardware,
    )


def played(link: Path, control: Path) -> RigPlan:
    """An RRC that an emulator plays."""
    ports = {"rrc": PortPlan(port=str(link))}
    return serial_plan(HardwarePlan(control={"rrc": control}, ports=ports))
