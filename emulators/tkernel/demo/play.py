"""`tickrig demo tkernel`: drive along a corridor, lose the service, keep the position."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import Final

from tickrig.emulators.tkernel.demo.stage import BACK_M, LENGTH_M, Stage
from tickrig.emulators.tkernel.node.applications import SETTLEMENT
from tickrig.host.rtc.motion.geometry import Pose

Echo = Callable[[str], None]

SECOND_US: Final = 1_000_000
STEP_US: Final = 100_000
"""How often the robot looks: as often as the reader tells."""

ROW_US: Final = 2 * SECOND_US
BOOTED_US: Final = 4 * SECOND_US
LEG_US: Final = 60 * SECOND_US
"""More than a way along the corridor takes."""

NEAR_M: Final = 0.02
HEAD: Final = "   time   x true   x odometry   x believed   off     hits stale misses failures"


@dataclass(frozen=True, slots=True)
class Moment:
    """What was seen at one time.

    Attributes:
        time_s: since the beginning.
        outage: whether the service was unreachable.
        error_m: how far off the robot believed to be.
        odometry_error_m: how far off it would be by its odometry alone.
    """

    time_s: float
    outage: bool
    error_m: float
    odometry_error_m: float


def run_demo(stage: Stage, echo: Echo) -> list[Moment]:
    """Play it.

    Args:
        stage: at its beginning.
        echo: takes lines for people.

    Returns:
        What was seen each 100 ms from the first step on.
    """
    moments: list[Moment] = []
    stage.loop.activate("tuned")
    stage.run_to(BOOTED_US)
    echo("The node has booted. The wheels are worn: for 8.96 m the odometry counts 8 m.\n")
    echo(f"The cart drives {LENGTH_M:g} m along the corridor; the service answers.\n{HEAD}")
    _drive(stage, Pose(LENGTH_M, 0.0, 0.0), moments, echo)
    stage.service.inputs.set("unreachable", 1)
    echo(f"\nThe service is unreachable. The cart drives back.\n{HEAD}")
    _drive(stage, Pose(BACK_M, 0.0, pi), moments, echo)
    worst_m = max(moment.error_m for moment in moments if moment.outage)
    alone_m = max(moment.odometry_error_m for moment in moments)
    echo(f"\nOff by {worst_m:.2f} m at most in the outage; the odometry alone: {alone_m:.2f} m.")
    return moments


def _drive(stage: Stage, goal: Pose, moments: list[Moment], echo: Echo) -> None:
    loop = stage.loop
    begin_us = loop.now_us
    loop.chain.position_input.goal(goal)
    while loop.now_us < begin_us + LEG_US:
        stage.run_to(loop.now_us + STEP_US)
        moments.append(_moment(stage))
        if loop.now_us % ROW_US == 0:
            echo(_row(stage))
        if _arrived(stage, goal):
            return


def _arrived(stage: Stage, goal: Pose) -> bool:
    pose = stage.loop.chain.odometry.pose
    return abs(pose.x - goal.x) < NEAR_M and abs(pose.y - goal.y) < NEAR_M


def _moment(stage: Stage) -> Moment:
    loop = stage.loop
    odometry, true = loop.chain.odometry.pose, loop.pose
    alone_m = ((odometry.x - true.x) ** 2 + (odometry.y - true.y) ** 2) ** 0.5
    outage = not stage.service.reachable
    return Moment(loop.now_us / 1e6, outage, stage.error_m, alone_m)


def _row(stage: Stage) -> str:
    counts = stage.lookup(SETTLEMENT).cache.counts
    loop = stage.loop
    return (
        f"{loop.now_us / 1e6:6.1f} s {loop.pose.x:6.2f} m {loop.chain.odometry.pose.x:10.2f} m"
        f" {stage.estimate.x_m:10.2f} m {stage.error_m:5.2f} m {counts.hits:6} {counts.stale:5}"
        f" {counts.misses:6} {counts.failures:8}"
    )
