"""What the motion components read and write at their ports."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from typing import TypeVar

from tickrig.host.motion.geometry import Pose, wrap
from tickrig.host.rtc.data_port import InPort
from tickrig.wire.rtc_types.extended_2d import Point2D, Pose2D
from tickrig.wire.rtc_types.idl import Struct

T = TypeVar("T", bound=Struct)


def arrived(port: InPort[T]) -> Iterator[T]:
    """Yield what arrived since the last read, oldest first."""
    while port.is_new and (value := port.read()) is not None:
        yield value


def newest(port: InPort[T]) -> T | None:
    """Return what arrived last, None if nothing did; the rest is dropped."""
    latest = None
    for value in arrived(port):
        latest = value
    return latest


def to_pose(data: Pose2D) -> Pose | None:
    """Return a pose, its heading in -pi..pi; None if a number is none (NaN, infinite)."""
    numbers = (data.position.x, data.position.y, data.heading)
    if not all(isfinite(number) for number in numbers):
        return None
    x, y, heading = numbers
    return Pose(x, y, wrap(heading))


def to_pose_2d(pose: Pose) -> Pose2D:
    """Return a pose as ports carry it."""
    return Pose2D(Point2D(pose.x, pose.y), pose.heading)
