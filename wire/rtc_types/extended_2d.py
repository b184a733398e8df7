# ruff: noqa: E741, N815, RUF009 - names as in the IDL, defaults are frozen
"""ExtendedDataTypes.idl of OpenRTM-aist 1.x, in the plane, and the colour: m, rad."""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.wire.rtc_types.basic import Time
from tickrig.wire.rtc_types.idl import Double, Struct


@dataclass(frozen=True, slots=True)
class RGBColour(Struct):
    """A colour, each part 0.0..1.0."""

    r: Double = 0.0
    g: Double = 0.0
    b: Double = 0.0


@dataclass(frozen=True, slots=True)
class Point2D(Struct):
    """A point in the plane, in m."""

    x: Double = 0.0
    y: Double = 0.0


@dataclass(frozen=True, slots=True)
class Vector2D(Struct):
    """A vector in the plane, in m."""

    x: Double = 0.0
    y: Double = 0.0


@dataclass(frozen=True, slots=True)
class Pose2D(Struct):
    """A pose in the plane: m, rad."""

    position: Point2D = Point2D()
    heading: Double = 0.0


@dataclass(frozen=True, slots=True)
class Velocity2D(Struct):
    """A velocity in the plane: m/s, m/s, rad/s."""

    vx: Double = 0.0
    vy: Double = 0.0
    va: Double = 0.0


@dataclass(frozen=True, slots=True)
class Acceleration2D(Struct):
    """An acceleration in the plane, in m/s^2."""

    ax: Double = 0.0
    ay: Double = 0.0


@dataclass(frozen=True, slots=True)
class PoseVel2D(Struct):
    """A pose and a velocity in the plane."""

    pose: Pose2D = Pose2D()
    velocities: Velocity2D = Velocity2D()


@dataclass(frozen=True, slots=True)
class Size2D(Struct):
    """A size in the plane, in m."""

    l: Double = 0.0
    w: Double = 0.0


@dataclass(frozen=True, slots=True)
class Geometry2D(Struct):
    """Where a device stands on its parent, and its size."""

    pose: Pose2D = Pose2D()
    size: Size2D = Size2D()


@dataclass(frozen=True, slots=True)
class Covariance2D(Struct):
    """The upper half of the covariance matrix of a pose."""

    xx: Double = 0.0
    xy: Double = 0.0
    xt: Double = 0.0
    yy: Double = 0.0
    yt: Double = 0.0
    tt: Double = 0.0


@dataclass(frozen=True, slots=True)
class PointCovariance2D(Struct):
    """The upper half of the covariance matrix of a point."""

    xx: Double = 0.0
    xy: Double = 0.0
    yy: Double = 0.0


@dataclass(frozen=True, slots=True)
class Carlike(Struct):
    """A command for a car: m/s, rad."""

    speed: Double = 0.0
    steeringAngle: Double = 0.0


@dataclass(frozen=True, slots=True)
class SpeedHeading2D(Struct):
    """A speed and its direction: m/s, rad."""

    speed: Double = 0.0
    heading: Double = 0.0


@dataclass(frozen=True, slots=True)
class TimedRGBColour(Struct):
    """RGBColour, with its time."""

    tm: Time = Time()
    data: RGBColour = RGBColour()


@dataclass(frozen=True, slots=True)
class TimedPoint2D(Struct):
    """Point2D, with its time."""

    tm: Time = Time()
    data: Point2D = Point2D()


@dataclass(frozen=True, slots=True)
class TimedVector2D(Struct):
    """Vector2D, with its time."""

    tm: Time = Time()
    data: Vector2D = Vector2D()


@dataclass(frozen=True, slots=True)
class TimedPose2D(Struct):
    """Pose2D, with its time."""

    tm: Time = Time()
    data: Pose2D = Pose2D()


@dataclass(frozen=True, slots=True)
class TimedVelocity2D(Struct):
    """Velocity2D, with its time."""

    tm: Time = Time()
    data: Velocity2D = Velocity2D()


@dataclass(frozen=True, slots=True)
class TimedAcceleration2D(Struct):
    """Acceleration2D, with its time."""

    tm: Time = Time()
    data: Acceleration2D = Acceleration2D()


@dataclass(frozen=True, slots=True)
class TimedPoseVel2D(Struct):
    """PoseVel2D, with its time."""

    tm: Time = Time()
    data: PoseVel2D = PoseVel2D()


@dataclass(frozen=True, slots=True)
class TimedSize2D(Struct):
    """Size2D, with its time."""

    tm: Time = Time()
    data: Size2D = Size2D()


@dataclass(frozen=True, slots=True)
class TimedGeometry2D(Struct):
    """Geometry2D, with its time."""

    tm: Time = Time()
    data: Geometry2D = Geometry2D()


@dataclass(frozen=True, slots=True)
class TimedCovariance2D(Struct):
    """Covariance2D, with its time."""

    tm: Time = Time()
    data: Covariance2D = Covariance2D()


@dataclass(frozen=True, slots=True)
class TimedPointCovariance2D(Struct):
    """PointCovariance2D, with its time."""

    tm: Time = Time()
    data: PointCovariance2D = PointCovariance2D()


@dataclass(frozen=True, slots=True)
class TimedCarlike(Struct):
    """Carlike, with its time."""

    tm: Time = Time()
    data: Carlike = Carlike()


@dataclass(frozen=True, slots=True)
class TimedSpeedHeading2D(Struct):
    """SpeedHeading2D, with its time."""

    tm: Time = Time()
    data: SpeedHeading2D = SpeedHeading2D()
