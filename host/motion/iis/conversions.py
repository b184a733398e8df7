"""Values of one phase of the common interfaces as values of the next, and back.

What a phase cannot say is left out: sideways speed, `id` and `error` in phase 1. Headings
are in 0..2 pi on IIS interfaces, as they recommend, and in -pi..pi on those of RH3.
"""

from __future__ import annotations

from tickrig.host.motion.geometry import Pose, positive
from tickrig.host.motion.ports import sound, to_pose, to_pose_2d
from tickrig.wire.rtc_types import iis, iis_phase1, iis_phase2
from tickrig.wire.rtc_types.extended_2d import Velocity2D


def velocity_1_to_2(value: iis_phase1.TimedVelocity) -> iis_phase2.TimedVelocity:
    """Return a velocity straight ahead."""
    return iis_phase2.TimedVelocity(value.tm, vx=value.v, w=value.w)


def velocity_2_to_1(value: iis_phase2.TimedVelocity) -> iis_phase1.TimedVelocity:
    """Return a velocity without what goes sideways."""
    return iis_phase1.TimedVelocity(value.tm, value.vx, value.w)


def velocity_2_to_3(value: iis_phase2.TimedVelocity) -> iis.TimedVelocity2D:
    """Return the same velocity."""
    data = Velocity2D(value.vx, value.vy, value.w)
    return iis.TimedVelocity2D(value.tm, value.id, data, value.error)


def velocity_3_to_2(value: iis.TimedVelocity2D) -> iis_phase2.TimedVelocity:
    """Return the same velocity."""
    data = value.data
    return iis_phase2.TimedVelocity(value.tm, value.id, data.vx, data.vy, data.va, value.error)


def position_2_to_3(value: iis_phase2.TimedPosition) -> iis.TimedPose2D | None:
    """Return the same pose, heading in 0..2 pi; None if a number is none."""
    if not sound(value.x, value.y, value.theta):
        return None
    pose = Pose(value.x, value.y, positive(value.theta))
    return iis.TimedPose2D(value.tm, value.id, to_pose_2d(pose), value.error)


def position_3_to_2(value: iis.TimedPose2D) -> iis_phase2.TimedPosition | None:
    """Return the same pose, heading in 0..2 pi; None if a number is none."""
    pose = to_pose(value.data)
    if pose is None:
        return None
    heading = positive(pose.heading)
    return iis_phase2.TimedPosition(value.tm, value.id, pose.x, pose.y, heading, value.error)


def with_positive_heading(value: iis.TimedPose2D) -> iis.TimedPose2D | None:
    """Return a pose with its heading in 0..2 pi; None if a number is none."""
    pose = to_pose(value.data)
    if pose is None:
        return None
    data = to_pose_2d(pose._replace(heading=positive(pose.heading)))
    return iis.TimedPose2D(value.tm, value.id, data, value.error)


def with_wrapped_heading(value: iis.TimedPose2D) -> iis.TimedPose2D | None:
    """Return a pose with its heading in -pi..pi; None if a number is none."""
    pose = to_pose(value.data)
    if pose is None:
        return None
    return iis.TimedPose2D(value.tm, value.id, to_pose_2d(pose), value.error)
