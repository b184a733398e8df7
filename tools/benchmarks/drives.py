"""32 drives with physics in cyclic synchronous position mode, on a bus of 1 Mbit/s.

SYNC every 10 ms; a target for each drive and an actual value from each one with it.
Control and physics of each drive run every millisecond.
"""

from __future__ import annotations

from math import cos, pi
from typing import Final

from benchmarks.table import rates
from tickrig.device.canopen.core.nonvolatile import Nonvolatile
from tickrig.device.canopen.models import epos
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig, Station
from tickrig.wire.can import CanFrame, Frames

DRIVES: Final = 32
CYCLE_US: Final = 10_000
SIMULATED_S: Final = 2
START: Final = CanFrame(0x000, bytes.fromhex("0100"))
SYNC: Final = CanFrame(0x080, b"")
CONTROLWORDS: Final = (0x06, 0x07, 0x0F)
AMPLITUDE: Final = 4_000
PERIOD_US: Final = 1_000_000


class Master:
    """Enables all drives, then has them swing like a cosine."""

    def __init__(self) -> None:
        self.tick_us, self.due_us = CYCLE_US, 0

    def reset(self) -> None:
        """Begin anew."""
        self.due_us = 0

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Send targets and SYNC."""
        cycle = now_us // CYCLE_US
        self.due_us = (cycle + 1) * CYCLE_US
        if cycle < 2:
            return (START,)
        controlword = CONTROLWORDS[min(cycle - 2, 2)]
        target = round(AMPLITUDE * (1 - cos(2 * pi * now_us / PERIOD_US))) if cycle > 8 else 0
        data = controlword.to_bytes(2, "little") + target.to_bytes(4, "little")
        return (SYNC, *(CanFrame(0x300 + number, data) for number in range(1, DRIVES + 1)))


def stored() -> Nonvolatile:
    """Make what a drive has kept: mode 8, PDOs that go with SYNC."""
    made, kept = epos.dictionary(), Nonvolatile()
    for at, value in (
        ((0x6060, 0), 8),
        ((0x1400, 1), 0x8000_0200),
        ((0x1401, 2), 1),
        ((0x1800, 2), 1),
    ):
        kept.parameters[made[at].key] = made[at].data_type.encode(value)
    return kept


def run(seconds: float) -> None:
    """Print how many seconds of the drives pass in a second."""
    rigs = []

    def turn() -> None:
        wire = CanWire()
        stations = [
            Station(epos.make_epos(number, stored()), wire.end()) for number in range(1, DRIVES + 1)
        ]
        rigs.append(stations)
        Rig(Station(Master(), wire.end()), *stations).run_for(SIMULATED_S * 1_000_000)

    rates(f"{DRIVES} drives in csp, SYNC {CYCLE_US // 1000} ms", SIMULATED_S, "x real time", turn)
