"""What the motion components read and write at their ports."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, TypeVar

from tickrig.host.motion.geometry import Pose, wrap
from tickrig.host.rtc.ports.data_port import InPort
from tickrig.wire.rtc_types.extended_2d import Point2D, Pose2D
from tickrig.wire.rtc_types.idl import Struct

T = TypeVar("T", bound=Struct)

MOST: Final = 1e9
"""Numbers beyond it are no metres, radians or speeds of a cart."""


def arrived(port: InPort[T]) -> Iterator[T]:
    """Yield what arrived since the last read, oldest first."""
    while port.is_new and (value := port.read()) is not None:
        yield value


def newest(port: InPort[T]) -> T | None:
    """Return what arrived last, None if nothing did; the rest is dropped."""
    latest = None
    while port.is_new:
        latest = port.read()
    return latest


def sound(*numbers: float) -> bool:
    """Return whether these are numbers of a cart: not NaN, infinite or beyond `MOST`."""
    for number in numbers:  # noqa: SIM110 - all() takes twice as long
        if not -MOST <= number <= MOST:
            return False
    return True


def to_pose(data: Pose2D) -> Pose | None:
    """Return a pose, its heading in -pi..pi; None if a number is not `sound`."""
    x, y, heading = data.position.x, data.position.y, data.heading
    return Pose(x, y, wrap(heading)) if sound(x, y, heading) else None


def to_pose_2d(pose: Pose) -> Pose2D:
    """Return a pose as ports carry it."""
    return Pose2D(Point2D(pose.x, pose.y), pose.heading)
