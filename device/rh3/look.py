"""What can be seen of a base at one time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from tickrig.device.body.pose import Pose
from tickrig.device.rh3.parameters import COUNTS_PER_RAD

Pair = tuple[float, float]


class Look(NamedTuple):
    """A base, as the world saw it; pairs are left and right unless said otherwise.

    Attributes:
        pose: of the middle of the axle.
        speed: m/s forward, rad/s to the left.
        travel: counts of the wheels.
        slip: m/s.
        torque: per mille.
        status: as in the register.
        frames: requests served, frames garbled.
    """

    pose: Pose
    speed: Pair
    travel: Pair
    slip: Pair
    torque: Pair
    status: int
    frames: tuple[int, int]


READ: Final[Mapping[str, Callable[[Look], float]]] = {
    "x_m": lambda look: look.pose.x_m,
    "y_m": lambda look: look.pose.y_m,
    "heading_rad": lambda look: look.pose.heading_rad,
    "speed_m_s": lambda look: look.speed[0],
    "turn_rad_s": lambda look: look.speed[1],
    "angle_left_rad": lambda look: look.travel[0] / COUNTS_PER_RAD,
    "angle_right_rad": lambda look: look.travel[1] / COUNTS_PER_RAD,
    "slip_left_m_s": lambda look: look.slip[0],
    "slip_right_m_s": lambda look: look.slip[1],
    "torque_left_pm": lambda look: look.torque[0],
    "torque_right_pm": lambda look: look.torque[1],
    "status": lambda look: look.status,
    "served": lambda look: look.frames[0],
    "garbled": lambda look: look.frames[1],
}
"""By the names in `terminals.OUTPUTS`."""
