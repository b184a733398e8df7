"""Types of the reference hardware's own components (RH3 functional specification, data types)."""

from __future__ import annotations

from enum import IntEnum

from tickrig.wire.rtc_types.basic import Time
from tickrig.wire.rtc_types.idl import Double, Short, Struct


class NavigationState(IntEnum):
    """What `TimedState.data` says of a navigation."""

    FINISH = 0
    ANGLE_CHECK = 1
    TURNING = 2
    TURNING2 = 3
    GOAL_CHECK = 4
    SPEED_DOWN = 5
    STOPPING = 6


class RunMode(IntEnum):
    """What `Path.type` asks for."""

    FREE = 0
    STOP = 1
    LINEFOLLOW = 2
    TO_POINT = 3
    CIRCLEFOLLOW = 4
    SPIN = 5
    VEL = 6
    WHEEL_VEL = 7


class Path(Struct):
    """One relay point for the follower; `coordinate` and `r` are unused but for circles.

    The public ancestor of Navigation and PathFollower declares it in the module RTC (RS003,
    intellirobot.idl), so that an original component connects.
    """

    type: Short = RunMode.FREE
    coordinate: Short = 0
    x: Double = 0.0
    y: Double = 0.0
    theta: Double = 0.0
    v: Double = 0.0
    w: Double = 0.0
    r: Double = 0.0
    tm: Time = Time()
