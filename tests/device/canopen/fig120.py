"""The demonstration of Fig. 120 on a rig: f-palette 16, motor core unit 32, a master."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final, NamedTuple

from tests.emulators.can.can_bench import Log
from tickrig.device.canopen.models import f_palette, motor_core_unit
from tickrig.device.canopen.slave import Application, CanopenSlave
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.can import CanFrame, LogLine

GOLDEN: Final = Path(__file__).parents[2] / "golden"
ROWS: Final = json.loads((GOLDEN / "canopen" / "fig120.json").read_text())["fig120_setup"]
SETUP: Final = tuple(f"{row['id']}#{row['data'].replace(' ', '')}" for row in ROWS)
"""The frames of the set-up, in candump text."""

POTENTIOMETER: Final = json.loads((GOLDEN / "fig120_pot.json").read_text())["fig120_pot"]

MASTER: Final = ("000#", "610#", "620#")
"""What the master sends begins so."""

MEASURED: Final = 0x2A0
"""TPDO2 of the motor, which the set-up leaves on."""

PDOS: Final = (0x190, 0x290, 0x390, MEASURED)


class Seen(NamedTuple):
    """The motor at a time."""

    at_us: int
    target_deg: float
    angle_deg: float


def make_motor() -> CanopenSlave:
    return motor_core_unit.make_motor_core_unit(motor_core_unit.NODE_ID)


class Demo:
    """Both devices on a wire; the master is an end without a station.

    Attributes:
        log: what was on the bus.
    """

    def __init__(self, *, dense: bool = False) -> None:
        palette = f_palette.make_f_palette(f_palette.NODE_ID)
        self.wire, self.slave = CanWire(), make_motor()
        self.log, self.master = Log(self.wire), self.wire.end()
        self.palette, self.motor = Application.of(palette), Application.of(self.slave)
        stations = [Station(slave, self.wire.end()) for slave in (palette, self.slave)]
        self.rig = Rig(*stations, dense=dense)

    @property
    def now_us(self) -> int:
        return self.rig.now_us

    @property
    def heard(self) -> list[tuple[int, str]]:
        return [(at_us, str(frame)) for at_us, frame in self.log.heard]

    @property
    def lines(self) -> list[LogLine]:
        return [LogLine(at_us, "vcan0", frame) for at_us, frame in self.log.heard]

    def times_us(self, begin: str, since_us: int = 0) -> list[int]:
        """Return when frames that begin so had ended."""
        return [at for at, text in self.heard if at > since_us and text.startswith(begin)]

    def run_ms(self, ms: int) -> None:
        self.rig.run_to(self.now_us // 1_000 * 1_000 + ms * 1_000)

    def say(self, *texts: str) -> None:
        """Let the master send."""
        self.master.send(self.now_us, tuple(CanFrame.parse(text) for text in texts))

    def set_up(self) -> None:
        """Play the frames of the vector: each request when all before it were heard."""
        for number, text in enumerate(SETUP):
            if text.startswith(MASTER):
                self.await_frames(number)
                self.say(text)
        self.await_frames(len(SETUP))

    def await_frames(self, count: int) -> None:
        """Wait for so many frames; heartbeats come each 100 ms."""
        assert self.rig.run_until(lambda: len(self.told) >= count, 200_000)

    @property
    def told(self) -> list[str]:
        """What was on the bus but for PDOs."""
        frames = (heard for _, heard in self.log.heard if isinstance(heard, CanFrame))
        return [str(frame) for frame in frames if frame.can_id not in PDOS]

    def turn(self, volts: float) -> int:
        """Turn the potentiometer; return the tick that sees it."""
        self.palette.inputs.set("ai1_v", volts)
        return self.now_us // 1_000 * 1_000 + 1_000

    def watch_ms(self, ms: int) -> list[Seen]:
        """Look at the motor each ms."""
        seen = []
        for _ in range(ms):
            self.run_ms(1)
            seen.append(look(self.now_us, self.motor))
        return seen


def look(now_us: int, motor: Application) -> Seen:
    target, angle = motor.read("target_deg"), motor.read("angle_deg")
    assert not isinstance(target, str)
    assert not isinstance(angle, str)
    return Seen(now_us, target, angle)
