"""Driving a cart to goals, and recording its motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, Protocol

from tickrig.host.rtc.motion.chain import MotionChain
from tickrig.host.rtc.motion.components.omni_to_2wd import plan
from tickrig.host.rtc.motion.control_laws import VelocityLimits
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.motion_run import MotionRun, TrackSample, least_time_s
from tickrig.host.rtc.motion.ports import RunMode

PERIOD_US: Final = 20_000
SETTLE_US: Final = 500_000
"""Time for the components to start, and for a cart to stop after its goal is reached."""

_ERROR_CHECK_PERIODS: Final = 5
"""Number of samples from one check for a component in Error to the next."""

_TIMEOUT_FACTOR: Final = 3
"""Factor of the least time of a path. The time-out is half a minute longer."""
_TIMEOUT_EXTRA_S: Final = 30

OnSample = Callable[[TrackSample], None]


class BaseConnection(Protocol):
    """A cart with its components, in virtual or real time."""

    @property
    def chain(self) -> MotionChain:
        """Components of the cart."""
        ...

    @property
    def now_us(self) -> int:
        """The present time."""
        ...

    @property
    def pose(self) -> Pose:
        """Best known pose of the cart."""
        ...

    def run_to(self, t_us: int) -> None:
        """Continue until a time."""


def start(connection: BaseConnection, set_id: str = "default") -> None:
    """Activate a configuration set of a cart's components, then activate the components."""
    connection.chain.use(set_id)
    connection.chain.activate()
    connection.run_to(connection.now_us + SETTLE_US)


def stop(connection: BaseConnection) -> None:
    """Deactivate all components of a cart. RefHardRh3 then stops the base."""
    connection.chain.deactivate()
    connection.run_to(connection.now_us + 2 * PERIOD_US)


def drive(
    connection: BaseConnection,
    points: Sequence[Pose],
    watch: OnSample = lambda sample: None,
    timeout_us: int | None = None,
) -> MotionRun:
    """Drive a cart to a goal or along a path, and return the record of its motion.

    The drive ends half a second after the goal is reached, when a component is in Error, or at the
    time-out.

    Args:
        connection: connection to the cart, with active components.
        points: points of the path. A single point is a goal.
        watch: function that is called with each sample of the record.
        timeout_us: time limit in us. By default, it is three times the shortest possible time plus
            half a minute.

    Raises:
        ValueError: there is no point, or a number is invalid.
    """
    entered, start_us = connection.chain.position_input, connection.now_us
    finished = entered.finished
    entered.replace(*points)
    run = MotionRun(points[-1])
    until_us = start_us + (timeout_us or _timeout_us(connection, points))
    while connection.now_us < until_us:
        connection.run_to(min(connection.now_us + PERIOD_US, until_us))
        run.samples.append(_sample(connection, (connection.now_us - start_us) / 1e6))
        watch(run.samples[-1])
        if len(run.samples) % _ERROR_CHECK_PERIODS == 0 and connection.chain.in_error:
            break
        if entered.finished > finished and run.reached_s is None:
            run.reached_s = run.duration_s
            until_us = connection.now_us + SETTLE_US
    return run


def _timeout_us(connection: BaseConnection, points: Sequence[Pose]) -> int:
    least_s = least_time_s(plan(connection.chain.odometry.pose, points))
    return round((_TIMEOUT_FACTOR * least_s + _TIMEOUT_EXTRA_S) * 1e6)


def _sample(connection: BaseConnection, time_s: float) -> TrackSample:
    """Return the present sample of a cart."""
    follower = connection.chain.path_follower
    path = follower.path
    line = Pose(path.x, path.y, path.theta) if path.type == RunMode.LINEFOLLOW else None
    return TrackSample(time_s, connection.pose, follower.twist, line)


def set_latency(chain: MotionChain, response_s: float) -> None:
    """Set the parameter `latency` of a cart's components in their configuration set `tuned`.

    The latency is the time constant of the base, plus one and a half periods.

    Args:
        chain: components of the cart.
        response_s: time constant of the base in s.
    """
    latency = f"{1.5 * PERIOD_US / 1e6 + response_s:g}"
    for component in (chain.navigation, chain.path_follower):
        component.configuration.set("latency", latency, "tuned")


# The quality of a drive, as lines of text.


def table(run: MotionRun, start: Pose, points: Sequence[Pose], limits: VelocityLimits) -> list[str]:
    """Return the quality of a drive as lines of text, one for each measure."""
    least_s, track = least_time_s(plan(start, points)), run.cross_track
    took_s = run.duration_s if run.reached_s is None else run.reached_s
    share = f", {took_s / least_s:.2f} x the least time" if least_s else ""
    lost = run.violations(limits)
    return [
        f"time         {took_s:.2f} s{share}",
        f"at the end   {run.error_m * 1e3:.1f} mm and {run.heading_error_rad:.4f} rad off the goal",
        f"cross-track  {track.rms * 1e3:.1f} mm rms, {track.most * 1e3:.1f} mm at most,"
        " on legs of 1 m and more",
        f"turning      {run.turning_rad_s:.2f} rad/s in all changes",
        f"limits       {f'{lost} commands beyond them' if lost else 'kept'}",
    ]


def limits_of(chain: MotionChain) -> VelocityLimits:
    """Return the limits that a chain is configured to keep."""
    return chain.path_follower.limits(PERIOD_US)
