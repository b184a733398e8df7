# ruff: noqa: E741 - names as in the IDL, defaults are frozen
"""ExtendedDataTypes.idl of OpenRTM-aist 1.x, in space. Lengths in m, angles in rad."""

from __future__ import annotations

from tickrig.wire.rtc_types.basic import Timed
from tickrig.wire.rtc_types.idl import Double, Struct


class Point3D(Struct):
    """A point in space, in m."""

    x: Double = 0.0
    y: Double = 0.0
    z: Double = 0.0


class Vector3D(Struct):
    """A vector in space, in m."""

    x: Double = 0.0
    y: Double = 0.0
    z: Double = 0.0


class Orientation3D(Struct):
    """Roll, pitch and yaw in rad."""

    r: Double = 0.0
    p: Double = 0.0
    y: Double = 0.0


class Pose3D(Struct):
    """A pose in space."""

    position: Point3D = Point3D()
    orientation: Orientation3D = Orientation3D()


class Velocity3D(Struct):
    """A velocity in space: m/s, then roll, pitch and yaw in rad/s."""

    vx: Double = 0.0
    vy: Double = 0.0
    vz: Double = 0.0
    vr: Double = 0.0
    vp: Double = 0.0
    va: Double = 0.0


class AngularVelocity3D(Struct):
    """An angular velocity in rad/s."""

    avx: Double = 0.0
    avy: Double = 0.0
    avz: Double = 0.0


class Acceleration3D(Struct):
    """An acceleration in space, in m/s^2."""

    ax: Double = 0.0
    ay: Double = 0.0
    az: Double = 0.0


class AngularAcceleration3D(Struct):
    """An angular acceleration in rad/s^2."""

    aax: Double = 0.0
    aay: Double = 0.0
    aaz: Double = 0.0


class PoseVel3D(Struct):
    """A pose and a velocity in space."""

    pose: Pose3D = Pose3D()
    velocities: Velocity3D = Velocity3D()


class Size3D(Struct):
    """A size in space, in m."""

    l: Double = 0.0
    w: Double = 0.0
    h: Double = 0.0


class Geometry3D(Struct):
    """Where a device stands on its parent, and its size."""

    pose: Pose3D = Pose3D()
    size: Size3D = Size3D()


class Covariance3D(Struct):
    """The upper half of the covariance matrix of a pose."""

    xx: Double = 0.0
    xy: Double = 0.0
    xz: Double = 0.0
    xr: Double = 0.0
    xp: Double = 0.0
    xa: Double = 0.0
    yy: Double = 0.0
    yz: Double = 0.0
    yr: Double = 0.0
    yp: Double = 0.0
    ya: Double = 0.0
    zz: Double = 0.0
    zr: Double = 0.0
    zp: Double = 0.0
    za: Double = 0.0
    rr: Double = 0.0
    rp: Double = 0.0
    ra: Double = 0.0
    pp: Double = 0.0
    pa: Double = 0.0
    aa: Double = 0.0


class SpeedHeading3D(Struct):
    """A speed in m/s and its direction."""

    speed: Double = 0.0
    direction: Orientation3D = Orientation3D()


class OAP(Struct):
    """Orientation, approach and position of an end effector."""

    orientation: Vector3D = Vector3D()
    approach: Vector3D = Vector3D()
    position: Vector3D = Vector3D()


class Quaternion(Struct):
    """A rotation."""

    x: Double = 0.0
    y: Double = 0.0
    z: Double = 0.0
    w: Double = 0.0


class TimedPoint3D(Timed[Point3D]):
    """Point3D, with its time."""


class TimedVector3D(Timed[Vector3D]):
    """Vector3D, with its time."""


class TimedOrientation3D(Timed[Orientation3D]):
    """Orientation3D, with its time."""


class TimedPose3D(Timed[Pose3D]):
    """Pose3D, with its time."""


class TimedVelocity3D(Timed[Velocity3D]):
    """Velocity3D, with its time."""


class TimedAngularVelocity3D(Timed[AngularVelocity3D]):
    """AngularVelocity3D, with its time."""


class TimedAcceleration3D(Timed[Acceleration3D]):
    """Acceleration3D, with its time."""


class TimedAngularAcceleration3D(Timed[AngularAcceleration3D]):
    """AngularAcceleration3D, with its time."""


class TimedPoseVel3D(Timed[PoseVel3D]):
    """PoseVel3D, with its time."""


class TimedSize3D(Timed[Size3D]):
    """Size3D, with its time."""


class TimedGeometry3D(Timed[Geometry3D]):
    """Geometry3D, with its time."""


class TimedCovariance3D(Timed[Covariance3D]):
    """Covariance3D, with its time."""


class TimedSpeedHeading3D(Timed[SpeedHeading3D]):
    """SpeedHeading3D, with its time."""


class TimedOAP(Timed[OAP]):
    """OAP, with its time."""


class TimedQuaternion(Timed[Quaternion]):
    """Quaternion, with its time."""
