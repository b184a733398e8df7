"""Drives with physics in cyclic synchronous position mode, on a bus of 1 Mbit/s.

SYNC every 10 ms, where so many fit; a target for each drive and an actual value from each one
with it. Control and physics of each drive run every millisecond.
"""

from __future__ import annotations

from functools import cache, partial
from math import cos, pi
from typing import Final

from benchmarks.table import rates
from tickrig.device.canopen.models import epos
from tickrig.device.canopen.slave import Nonvolatile
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.can import CanFrame, Frames

CYCLE_US: Final = 10_000
SIMULATED_S: Final = 2
ALONE_S: Final = 20
START: Final = CanFrame(0x000, bytes.fromhex("0100"))
SYNC: Final = CanFrame(0x080, b"")
CONTROLWORDS: Final = (0x06, 0x07, 0x0F)
AMPLITUDE: Final = 4_000
PERIOD_US: Final = 1_000_000


class Master:
    """Enables all drives, then has them swing like a cosine."""

    def __init__(self, drives: int, cycle_us: int) -> None:
        self.drives, self.tick_us, self.due_us = drives, cycle_us, 0

    def reset(self) -> None:
        """Begin anew."""
        self.due_us = 0

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Send targets and SYNC."""
        cycle = now_us // self.tick_us
        self.due_us = (cycle + 1) * self.tick_us
        if cycle < 2:
            return (START,)
        controlword = CONTROLWORDS[min(cycle - 2, 2)]
        target = round(AMPLITUDE * (1 - cos(2 * pi * now_us / PERIOD_US))) if cycle > 8 else 0
        data = controlword.to_bytes(2, "little") + target.to_bytes(4, "little")
        return (SYNC, *(CanFrame(0x300 + number, data) for number in range(1, self.drives + 1)))


@cache
def stored(cycle_us: int) -> dict[int, bytes]:
    """Return what a drive has kept: mode 8, PDOs that go with SYNC, its cycle."""
    made, kept = epos.dictionary(), dict[int, bytes]()
    for at, value in (
        ((0x6060, 0), 8),
        ((0x1400, 1), 0x8000_0200),
        ((0x1401, 2), 1),
        ((0x1800, 2), 1),
        ((0x60C2, 1), cycle_us // 1_000),
    ):
        kept[made[at].key] = made[at].data_type.encode(value)
    return kept


def rig(drives: int, cycle_us: int) -> Rig:
    """Put drives and their master onto a bus."""
    wire = CanWire()
    stations = [
        Station(epos.make_epos(number, Nonvolatile(dict(stored(cycle_us)))), wire.end())
        for number in range(1, drives + 1)
    ]
    return Rig(Station(Master(drives, cycle_us), wire.end()), *stations)


def run(seconds: float) -> None:
    """Print how many seconds of the drives pass in a second."""
    for drives, cycle_us in ((32, CYCLE_US), (127, 4 * CYCLE_US)):
        what = f"{drives} drives in csp, SYNC {cycle_us // 1_000} ms"
        turn = partial(swinging(drives, cycle_us).run_for, SIMULATED_S * 1_000_000)
        rates(what, SIMULATED_S, "x real time", turn)
    turn = partial(swinging(1, CYCLE_US).run_for, ALONE_S * 1_000_000)
    rates("one drive in csp, SYNC 10 ms", ALONE_S, "x real time", turn)


def swinging(drives: int, cycle_us: int) -> Rig:
    """Return a rig whose drives have been made and follow the cosine."""
    made = rig(drives, cycle_us)
    made.run_for(1_000_000)
    return made
