"""IIS.idl, version 1.0: common interfaces of mobile robots (RSi2/NEDO, mobile WG, 2010).

Map frame for poses, paths and goals, robot frame for velocities. `id` and
`error` are as each application wants.
"""

from __future__ import annotations

from typing import ClassVar

from tickrig.wire.rtc_types.basic import Stamped
from tickrig.wire.rtc_types.extended_2d import Pose2D, Velocity2D
from tickrig.wire.rtc_types.idl import Double, Long


class IisStruct(Stamped):
    """A struct of the module IIS, which begins with its time and `id`."""

    idl_module: ClassVar[str] = "IIS"

    id: tuple[Long, ...] = ()


class TimedPose2D(IisStruct):
    """The estimated pose of a robot, or how far it came on its path."""

    data: Pose2D = Pose2D()
    error: tuple[Double, ...] = ()


class TimedPath2DSeq(IisStruct):
    """A path: way points with the velocity at each; the first is the start, none means stop."""

    pose: tuple[Pose2D, ...] = ()
    velocity: tuple[Velocity2D, ...] = ()
    error: tuple[Double, ...] = ()


class TimedVelocity2D(IisStruct):
    """The velocity that is commanded, or measured."""

    data: Velocity2D = Velocity2D()
    error: tuple[Double, ...] = ()


class TimedPose2DSeq(IisStruct):
    """A goal: only the first pose counts, none clears it."""

    data: tuple[Pose2D, ...] = ()
    error: tuple[Double, ...] = ()
