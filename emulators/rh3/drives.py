"""Let a cart in virtual time drive to goals, and note what it does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from tickrig.emulators.rh3.closed_loop import Cart, ClosedLoop
from tickrig.host.motion.geometry import Pose
from tickrig.host.motion.journey import Journey, Sample
from tickrig.wire.rtc_types.rh2 import RunMode

PERIOD_US: Final = 20_000
REST_US: Final = 500_000
"""The cart may roll on so long after its goal is reached."""

Watch = Callable[[Sample], None]


def sample(cart: Cart, time_s: float) -> Sample:
    """Return what a cart does now, where it truly is."""
    follower = cart.chain.path_follower
    path = follower.path
    line = Pose(path.x, path.y, path.theta) if path.type == RunMode.LINEFOLLOW else None
    return Sample(time_s, cart.truth, follower.twist, line)


def expect(cart: Cart, response_s: float) -> None:
    """Let the set `tuned` expect a base's time constant, and one period and a half of delay."""
    latency = f"{1.5 * PERIOD_US / 1e6 + response_s:g}"
    for component in (cart.chain.navigation, cart.chain.path_follower):
        component.configuration.set("latency", latency, "tuned")


def drive(
    loop: ClosedLoop,
    points: Sequence[Pose],
    timeout_us: int = 600_000_000,
    watch: Watch = lambda sample: None,
) -> Journey:
    """Let the first cart go to a goal, or along a path of several points.

    Args:
        loop: its components are active.
        points: one is a goal.
        timeout_us: when to give up.
        watch: told each sample.
    """
    cart, start_us, journey = loop.cart, loop.now_us, Journey(points[-1])
    entered = cart.chain.position_input
    finished = entered.finished
    if len(points) == 1:
        entered.goal(points[0])
    else:
        entered.path(points)
    until_us = start_us + timeout_us
    while loop.now_us < until_us:
        loop.run_to(min(loop.now_us + PERIOD_US, until_us))
        latest = sample(cart, (loop.now_us - start_us) / 1e6)
        journey.samples.append(latest)
        watch(latest)
        if entered.finished > finished and not journey.finished:
            journey.finished, until_us = True, loop.now_us + REST_US
    return journey
