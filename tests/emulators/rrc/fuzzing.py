"""Random lines, buttons, faults and power cuts for an RRC in virtual time: `tools/fuzz rrc`."""

from __future__ import annotations

from random import Random
from typing import Final

from tickrig.device.physical import SignalType
from tickrig.device.rrc.board import INPUTS
from tickrig.device.rrc.machine import TICK_US, Rrc
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.wire.rrc import commands as cmd

ASK: Final = b"\n" + cmd.DeviceName().encode() + cmd.DeviceName().encode(check=True)
"""One of the two is right, with stablemode or without; the LF ends what noise began."""

LINES: Final = 1_000
"""Of a conversation."""

RARE: Final = {item.name for item in INPUTS if item.type is SignalType.FAULT} | {
    "rrc_power",
    "extra_load_pct",
}


class RrcFuzz:
    """An RRC under random lines, buttons, faults and power cuts."""

    def __init__(self, chance: Random) -> None:
        self.chance, self.line, self.rrc = chance, SerialLine(), Rrc()
        self.rig = Rig(Station(self.rrc, self.line.a))

    def throw(self) -> None:
        """Send one line and let some time pass, mostly as much as the line needs."""
        data = self.random_line()
        self.line.b.send(self.rig.now_us, data)
        self.rig.run_for(
            self.chance.choice((0, len(data) * 87, len(data) * 87, TICK_US, 5 * TICK_US))
        )
        if self.chance.random() < 0.05:
            self.touch()
        self.line.b.poll(self.rig.now_us)

    def random_line(self) -> bytes:
        """Return a command with random digits, a spoilt one, or noise."""
        chance = self.chance
        kind = chance.choice(list(cmd.COMMANDS.values()))
        digits = b"".join(p.write(chance.randint(p.low, p.high)) for p in kind.parameters)
        message = kind.name + kind.literal + digits
        if chance.random() < 0.5:
            message += b"%X" % (sum(message) & 0xF)
        if chance.random() < 0.3:
            at = chance.randrange(len(message))
            message = message[:at] + chance.randbytes(chance.randrange(4)) + message[at + 1 :]
        return (
            message if chance.random() < 0.95 else chance.randbytes(chance.randrange(300))
        ) + b"\n"

    def touch(self) -> None:
        """Press or release the power button, or set another input; most have no fault."""
        item = self.chance.choice(INPUTS)
        if self.chance.random() < 0.5:
            self.rrc.inputs.set("power_button", 1 - self.rrc.inputs["power_button"])
        elif item.name in RARE and self.chance.random() < 0.95:
            self.rrc.inputs.set(item.name, item.initial)
        else:
            self.rrc.inputs.set(item.name, self.chance.randint(int(item.low), int(item.high)))

    def answers(self) -> bool:
        """Say whether the device, once it has power and peace, answers `device`."""
        self.rrc.inputs.set("rrc_power", 1)
        self.rrc.inputs.set("extra_load_pct", 0)
        self.rig.run_for(400 * TICK_US)
        self.line.b.poll(self.rig.now_us)
        self.line.b.send(self.rig.now_us, ASK)
        self.rig.run_for(10 * TICK_US)
        return b"RRC\n" in self.line.b.poll(self.rig.now_us)


def mutated(chance: Random) -> tuple[str, bytes]:
    """Choose the seed of a conversation."""
    return "conversation", chance.randbytes(8)


def judge(_name: str, data: bytes) -> str:
    """Send the lines; AssertionError unless the device answers afterwards.

    Returns:
        The state after the last line.
    """
    fuzz = RrcFuzz(Random(data))
    for _ in range(LINES):
        fuzz.throw()
    state = str(fuzz.rrc.read("state"))
    assert fuzz.answers(), f"silent in state {state}"
    return state
