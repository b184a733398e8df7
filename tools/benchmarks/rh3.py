"""A cart of Reference Hardware 3, closed loop in virtual time, beside another controller."""

from __future__ import annotations

import time
from collections.abc import Sequence
from math import pi, sqrt

from benchmarks.pursuit import Pursuit, Tolerance, beside
from benchmarks.table import RUNS, row
from tickrig.emulators.rh3.closed_loop import ClosedLoop
from tickrig.host.rtc.motion.drive import SETTLE_US, drive, start
from tickrig.host.rtc.motion.geometry import Pose

GOAL = (Pose(1.0, 0.5, pi / 2),)
SQUARE = (Pose(2.0), Pose(2.0, 2.0), Pose(0.0, 2.0), Pose())
PERIOD_US = 20_000
TIMEOUT_US = 120_000_000


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    del seconds
    speed()
    for name, points in (("goal 1, 0.5, 90 deg", GOAL), ("square of 2 m", SQUARE)):
        for set_id in ("default", "tuned"):
            chain(name, points, set_id)
        pursuit(f"{name}: pure pursuit, as Nav2 has it", points, Tolerance())
        pursuit(f"{name}: the same, 20 mm, 0.01 rad", points, Tolerance(0.02, 0.01))


def speed() -> None:
    """Drive to a goal; six components, line and base."""
    values = []
    for _ in range(RUNS):
        loop = ClosedLoop()
        start(loop)
        began = time.process_time()
        run = drive(loop, GOAL)
        values.append(run.duration_s / (time.process_time() - began))
    row("a cart with its six components, line and base", values, "x real time")


def chain(name: str, points: Sequence[Pose], set_id: str) -> None:
    """Drive with the six components."""
    loop = ClosedLoop()
    start(loop, set_id)
    run = drive(loop, points)
    assert run.reached_s is not None
    track = [s.pose for s in run.samples if s.line is not None]
    tell(f"{name}: RH3, {set_id}", run.end, points, track, run.reached_s)


def pursuit(name: str, points: Sequence[Pose], tolerance: Tolerance) -> None:
    """Drive with RefHardRh3, Odometry and the other controller."""
    loop = ClosedLoop()
    other = loop.manager.add(Pursuit((Pose(), *points), tolerance), context=loop.chain.context)
    loop.manager.disconnect("PathFollower0.velocity", "RefHardRh30.InTargetVelocity")
    loop.manager.connect("Odometry0.OdometryPosition", "Pursuit.position")
    loop.manager.connect("Pursuit.velocity", "RefHardRh30.InTargetVelocity")
    loop.manager.activate("RefHardRh30", "Odometry0")
    loop.run_to(SETTLE_US)
    loop.manager.activate("Pursuit")
    track: list[Pose] = []
    while not other.reached and loop.now_us < TIMEOUT_US:
        loop.run_to(loop.now_us + PERIOD_US)
        track += [loop.pose] if other.twist.v else []
    took_s = (loop.now_us - SETTLE_US) / 1e6
    loop.run_to(loop.now_us + SETTLE_US)
    tell(name if other.reached else f"{name} (never there)", loop.pose, points, track, took_s)


def tell(
    what: str, end: Pose, points: Sequence[Pose], track: Sequence[Pose], took_s: float
) -> None:
    """Print a row: error at the end, and distance from the lines on the way."""
    errors = [beside((Pose(), *points), pose) * 1e3 for pose in track]
    rms = sqrt(sum(error * error for error in errors) / len(errors))
    error_mm = end.distance(points[-1]) * 1e3
    print(
        f"| {what} | {error_mm:.1f} mm at the end | {rms:.1f} mm rms, {took_s:.1f} s |", flush=True
    )
