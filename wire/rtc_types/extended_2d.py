# ruff: noqa: E741, N815 - names as in the IDL, defaults are frozen
"""ExtendedDataTypes.idl of OpenRTM-aist 1.x, in the plane, and the colour: m, rad."""

from __future__ import annotations

from tickrig.wire.rtc_types.basic import Timed
from tickrig.wire.rtc_types.idl import Double, Struct


class RGBColour(Struct):
    """A colour, each part 0.0..1.0."""

    r: Double = 0.0
    g: Double = 0.0
    b: Double = 0.0


class Point2D(Struct):
    """A point in the plane, in m."""

    x: Double = 0.0
    y: Double = 0.0


class Vector2D(Struct):
    """A vector in the plane, in m."""

    x: Double = 0.0
    y: Double = 0.0


class Pose2D(Struct):
    """A pose in the plane: m, rad."""

    position: Point2D = Point2D()
    heading: Double = 0.0


class Velocity2D(Struct):
    """A velocity in the plane: m/s, m/s, rad/s."""

    vx: Double = 0.0
    vy: Double = 0.0
    va: Double = 0.0


class Acceleration2D(Struct):
    """An acceleration in the plane, in m/s^2."""

    ax: Double = 0.0
    ay: Double = 0.0


class PoseVel2D(Struct):
    """A pose and a velocity in the plane."""

    pose: Pose2D = Pose2D()
    velocities: Velocity2D = Velocity2D()


class Size2D(Struct):
    """A size in the plane, in m."""

    l: Double = 0.0
    w: Double = 0.0


class Geometry2D(Struct):
    """Where a device stands on its parent, and its size."""

    pose: Pose2D = Pose2D()
    size: Size2D = Size2D()


class Covariance2D(Struct):
    """The upper half of the covariance matrix of a pose."""

    xx: Double = 0.0
    xy: Double = 0.0
    xt: Double = 0.0
    yy: Double = 0.0
    yt: Double = 0.0
    tt: Double = 0.0


class PointCovariance2D(Struct):
    """The upper half of the covariance matrix of a point."""

    xx: Double = 0.0
    xy: Double = 0.0
    yy: Double = 0.0


class Carlike(Struct):
    """A command for a car: m/s, rad."""

    speed: Double = 0.0
    steeringAngle: Double = 0.0


class SpeedHeading2D(Struct):
    """A speed and its direction: m/s, rad."""

    speed: Double = 0.0
    heading: Double = 0.0


class TimedRGBColour(Timed[RGBColour]):
    """RGBColour, with its time."""


class TimedPoint2D(Timed[Point2D]):
    """Point2D, with its time."""


class TimedVector2D(Timed[Vector2D]):
    """Vector2D, with its time."""


class TimedPose2D(Timed[Pose2D]):
    """Pose2D, with its time."""


class TimedVelocity2D(Timed[Velocity2D]):
    """Velocity2D, with its time."""


class TimedAcceleration2D(Timed[Acceleration2D]):
    """Acceleration2D, with its time."""


class TimedPoseVel2D(Timed[PoseVel2D]):
    """PoseVel2D, with its time."""


class TimedSize2D(Timed[Size2D]):
    """Size2D, with its time."""


class TimedGeometry2D(Timed[Geometry2D]):
    """Geometry2D, with its time."""


class TimedCovariance2D(Timed[Covariance2D]):
    """Covariance2D, with its time."""


class TimedPointCovariance2D(Timed[PointCovariance2D]):
    """PointCovariance2D, with its time."""


class TimedCarlike(Timed[Carlike]):
    """Carlike, with its time."""


class TimedSpeedHeading2D(Timed[SpeedHeading2D]):
    """SpeedHeading2D, with its time."""
