"""Let a cart drive to goals, and note what it does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, Protocol

from tickrig.host.motion.chain import MotionChain
from tickrig.host.motion.components.omni_to_2wd import plan
from tickrig.host.motion.geometry import Pose
from tickrig.host.motion.journey import Journey, Sample
from tickrig.host.motion.least_time import least_time_s
from tickrig.wire.rtc_types.rh2 import RunMode

PERIOD_US: Final = 20_000
SETTLE_US: Final = 500_000
"""Time for the components to come up, and for a cart to roll on after its goal is reached."""

LOOK: Final = 5
"""Samples from one look for a component in Error to the next."""

PATIENCE: Final = 3
"""Times the least time that a way may take, and half a minute."""
PATIENCE_S: Final = 30

Watch = Callable[[Sample], None]


class Ride(Protocol):
    """A cart with its components, in virtual or real time."""

    @property
    def chain(self) -> MotionChain:
        """Its components."""
        ...

    @property
    def now_us(self) -> int:
        """The present time."""
        ...

    @property
    def pose(self) -> Pose:
        """Where it is, as well as can be known."""
        ...

    def run_to(self, t_us: int) -> None:
        """Go on to a time."""


def start(ride: Ride, set_id: str = "default") -> None:
    """Let a configuration set hold, and activate all components."""
    ride.chain.use(set_id)
    ride.chain.activate()
    ride.run_to(ride.now_us + SETTLE_US)


def stop(ride: Ride) -> None:
    """Deactivate all components; RefHardRh3 stops the base."""
    ride.chain.deactivate()
    ride.run_to(ride.now_us + 2 * PERIOD_US)


def drive(
    ride: Ride,
    points: Sequence[Pose],
    watch: Watch = lambda sample: None,
    timeout_us: int | None = None,
) -> Journey:
    """Let a cart go to a goal, or along a path of several points.

    It ends half a second after the goal is reached, when a component is in Error, or with
    the time-out.

    Args:
        ride: its components are active.
        points: one is a goal.
        watch: told each sample.
        timeout_us: when to give up; three times the least time and half a minute if left out.

    Raises:
        ValueError: no point, or a number that is none.
    """
    entered, start_us = ride.chain.position_input, ride.now_us
    finished = entered.finished
    entered.replace(*points)
    journey = Journey(points[-1])
    until_us = start_us + (timeout_us or _patience_us(ride, points))
    while ride.now_us < until_us:
        ride.run_to(min(ride.now_us + PERIOD_US, until_us))
        journey.samples.append(sample(ride, (ride.now_us - start_us) / 1e6))
        watch(journey.samples[-1])
        if len(journey.samples) % LOOK == 0 and ride.chain.in_error:
            break
        if entered.finished > finished and journey.reached_s is None:
            journey.reached_s = journey.duration_s
            until_us = ride.now_us + SETTLE_US
    return journey


def _patience_us(ride: Ride, points: Sequence[Pose]) -> int:
    least_s = least_time_s(plan(ride.chain.odometry.pose, points))
    return round((PATIENCE * least_s + PATIENCE_S) * 1e6)


def sample(ride: Ride, time_s: float) -> Sample:
    """Return what a cart does now."""
    follower = ride.chain.path_follower
    path = follower.path
    line = Pose(path.x, path.y, path.theta) if path.type == RunMode.LINEFOLLOW else None
    return Sample(time_s, ride.pose, follower.twist, line)


def expect(chain: MotionChain, response_s: float) -> None:
    """Let the set `tuned` expect a base's time constant, and one period and a half of delay."""
    latency = f"{1.5 * PERIOD_US / 1e6 + response_s:g}"
    for component in (chain.navigation, chain.path_follower):
        component.configuration.set("latency", latency, "tuned")
