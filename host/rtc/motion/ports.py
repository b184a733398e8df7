"""The values that the motion components read and write at their ports."""

from __future__ import annotations

from collections.abc import Iterator
from enum import IntEnum
from typing import Final, TypeVar

from tickrig.host.rtc import ExecutionContext, InPort, OutPort
from tickrig.host.rtc.motion.geometry import Pose, wrap
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.rtc import Point2D, Pose2D, Time, Velocity2D

T = TypeVar("T", bound=Struct)

MOST: Final = 1e9
"""Limit above which a number is not in metres, radians or a speed of a cart."""


class NavigationState(IntEnum):
    """Values of `TimedState.data` for a navigation."""

    FINISH = 0
    ANGLE_CHECK = 1
    TURNING = 2
    TURNING2 = 3
    GOAL_CHECK = 4
    SPEED_DOWN = 5
    STOPPING = 6


class RunMode(IntEnum):
    """Values of `Path.type`."""

    FREE = 0
    STOP = 1
    LINEFOLLOW = 2
    TO_POINT = 3
    CIRCLEFOLLOW = 4
    SPIN = 5
    VEL = 6
    WHEEL_VEL = 7


def read_all(port: InPort[T]) -> Iterator[T]:
    """Yield the values since the last read. The oldest value is first."""
    while port.is_new and (value := port.read()) is not None:
        yield value


def read_newest(port: InPort[T]) -> T | None:
    """Return the latest value, or None if there is none. Other values are dropped."""
    latest = None
    while port.is_new:
        latest = port.read()
    return latest


def plausible(*numbers: float) -> bool:
    """Return whether numbers are plausible for a cart: not NaN, infinite or beyond `MOST`."""
    for number in numbers:  # noqa: SIM110 - all() takes twice as long
        if not -MOST <= number <= MOST:
            return False
    return True


def to_pose(data: Pose2D) -> Pose | None:
    """Convert a pose from a port to a `Pose`, with its heading in -pi..pi.

    The result is None if a number is not `plausible`.
    """
    x, y, heading = data.position.x, data.position.y, data.heading
    return Pose(x, y, wrap(heading)) if plausible(x, y, heading) else None


def read_newest_pose(port: InPort[iis.TimedPose2D]) -> Pose | None:
    """Return the latest pose at a port, or None if there is no new, `plausible` pose."""
    latest = read_newest(port)
    return None if latest is None else to_pose(latest.data)


def write_velocity(
    port: OutPort[iis.TimedVelocity2D], ec: ExecutionContext, vx: float, vy: float, va: float
) -> None:
    """Write a velocity to a port, with the present time.

    Args:
        port: port to write to.
        ec: execution context that has the time.
        vx: forward velocity in m/s.
        vy: velocity to the left in m/s.
        va: angular velocity in rad/s, positive to the left.
    """
    port.write(iis.TimedVelocity2D(Time.from_us(ec.now_us), data=Velocity2D(vx, vy, va)))


def to_pose_2d(pose: Pose) -> Pose2D:
    """Convert a pose to the type that ports carry."""
    return Pose2D(Point2D(pose.x, pose.y), pose.heading)
