"""A range finder in virtual time: scans of a room, and a cart that looks where it goes."""

from __future__ import annotations

import time

from benchmarks.table import RUNS, row
from tickrig.device.urg.sensor import Urg
from tickrig.device.urg.world import World, room
from tickrig.emulators.rh3.closed_loop import ClosedLoop
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.options.obstacles import CollisionGuard
from tickrig.host.urg import UrgClient

SCANS = 100
SECOND_US = 1_000_000


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    del seconds
    scans()
    with_eyes("a cart with eyes, nothing around", World())
    with_eyes("a cart with eyes in a room", room(10, 10))


def scans() -> None:
    """Measure whole scans of a room, encode, carry and parse them."""
    values = []
    for _ in range(RUNS):
        line = SerialLine(12_000_000)
        rig, found = Rig(Station(Urg(world=room(4, 3)), line.a)), 0
        client, began = UrgClient(SimLink(rig, line.b)), time.process_time()
        while found < SCANS:
            rig.run_for(10_000)
            found += len(client.poll())
        values.append(found / (time.process_time() - began))
    row("scans of 682 steps in a room, sensor and host", values, "scans/s of processor")


def with_eyes(name: str, world: World) -> None:
    """Drive 10 s with eleven components, base and sensor."""
    values = []
    for _ in range(RUNS):
        loop = ClosedLoop(world=world)
        line = loop.range_finders[0].line.b
        guard = CollisionGuard(
            loop.manager, loop.chain, lambda name, loop=loop, line=line: SimLink(loop.rig, line)
        )
        loop.activate("tuned")
        guard.activate()
        loop.run_to(SECOND_US)
        loop.chain.position_input.goal(Pose(2.5))
        began = time.process_time()
        loop.run_to(11 * SECOND_US)
        values.append(10 / (time.process_time() - began))
    row(name, values, "x real time")
