# ruff: noqa: E741, RUF009 - names as in the IDL, defaults are frozen
"""ExtendedDataTypes.idl of OpenRTM-aist 1.x, in space. Lengths in m, angles in rad."""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.wire.rtc_types.basic import Time
from tickrig.wire.rtc_types.idl import Double, Struct


@dataclass(frozen=True, slots=True)
class Point3D(Struct):
    """A point in space, in m."""

    x: Double = 0.0
    y: Double = 0.0
    z: Double = 0.0


@dataclass(frozen=True, slots=True)
class Vector3D(Struct):
    """A vector in space, in m."""

    x: Double = 0.0
    y: Double = 0.0
    z: Double = 0.0


@dataclass(frozen=True, slots=True)
class Orientation3D(Struct):
    """Roll, pitch and yaw in rad."""

    r: Double = 0.0
    p: Double = 0.0
    y: Double = 0.0


@dataclass(frozen=True, slots=True)
class Pose3D(Struct):
    """A pose in space."""

    position: Point3D = Point3D()
    orientation: Orientation3D = Orientation3D()


@dataclass(frozen=True, slots=True)
class Velocity3D(Struct):
    """A velocity in space: m/s, then roll, pitch and yaw in rad/s."""

    vx: Double = 0.0
    vy: Double = 0.0
    vz: Double = 0.0
    vr: Double = 0.0
    vp: Double = 0.0
    va: Double = 0.0


@dataclass(frozen=True, slots=True)
class AngularVelocity3D(Struct):
    """An angular velocity in rad/s."""

    avx: Double = 0.0
    avy: Double = 0.0
    avz: Double = 0.0


@dataclass(frozen=True, slots=True)
class Acceleration3D(Struct):
    """An acceleration in space, in m/s^2."""

    ax: Double = 0.0
    ay: Double = 0.0
    az: Double = 0.0


@dataclass(frozen=True, slots=True)
class AngularAcceleration3D(Struct):
    """An angular acceleration in rad/s^2."""

    aax: Double = 0.0
    aay: Double = 0.0
    aaz: Double = 0.0


@dataclass(frozen=True, slots=True)
class PoseVel3D(Struct):
    """A pose and a velocity in space."""

    pose: Pose3D = Pose3D()
    velocities: Velocity3D = Velocity3D()


@dataclass(frozen=True, slots=True)
class Size3D(Struct):
    """A size in space, in m."""

    l: Double = 0.0
    w: Double = 0.0
    h: Double = 0.0


@dataclass(frozen=True, slots=True)
class Geometry3D(Struct):
    """Where a device stands on its parent, and its size."""

    pose: Pose3D = Pose3D()
    size: Size3D = Size3D()


@dataclass(frozen=True, slots=True)
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


@dataclass(frozen=True, slots=True)
class SpeedHeading3D(Struct):
    """A speed in m/s and its direction."""

    speed: Double = 0.0
    direction: Orientation3D = Orientation3D()


@dataclass(frozen=True, slots=True)
class OAP(Struct):
    """Orientation, approach and position of an end effector."""

    orientation: Vector3D = Vector3D()
    approach: Vector3D = Vector3D()
    position: Vector3D = Vector3D()


@dataclass(frozen=True, slots=True)
class Quaternion(Struct):
    """A rotation."""

    x: Double = 0.0
    y: Double = 0.0
    z: Double = 0.0
    w: Double = 0.0


@dataclass(frozen=True, slots=True)
class TimedPoint3D(Struct):
    """Point3D, with its time."""

    tm: Time = Time()
    data: Point3D = Point3D()


@dataclass(frozen=True, slots=True)
class TimedVector3D(Struct):
    """Vector3D, with its time."""

    tm: Time = Time()
    data: Vector3D = Vector3D()


@dataclass(frozen=True, slots=True)
class TimedOrientation3D(Struct):
    """Orientation3D, with its time."""

    tm: Time = Time()
    data: Orientation3D = Orientation3D()


@dataclass(frozen=True, slots=True)
class TimedPose3D(Struct):
    """Pose3D, with its time."""

    tm: Time = Time()
    data: Pose3D = Pose3D()


@dataclass(frozen=True, slots=True)
class TimedVelocity3D(Struct):
    """Velocity3D, with its time."""

    tm: Time = Time()
    data: Velocity3D = Velocity3D()


@dataclass(frozen=True, slots=True)
class TimedAngularVelocity3D(Struct):
    """AngularVelocity3D, with its time."""

    tm: Time = Time()
    data: AngularVelocity3D = AngularVelocity3D()


@dataclass(frozen=True, slots=True)
class TimedAcceleration3D(Struct):
    """Acceleration3D, with its time."""

    tm: Time = Time()
    data: Acceleration3D = Acceleration3D()


@dataclass(frozen=True, slots=True)
class TimedAngularAcceleration3D(Struct):
    """AngularAcceleration3D, with its time."""

    tm: Time = Time()
    data: AngularAcceleration3D = AngularAcceleration3D()


@dataclass(frozen=True, slots=True)
class TimedPoseVel3D(Struct):
    """PoseVel3D, with its time."""

    tm: Time = Time()
    data: PoseVel3D = PoseVel3D()


@dataclass(frozen=True, slots=True)
class TimedSize3D(Struct):
    """Size3D, with its time."""

    tm: Time = Time()
    data: Size3D = Size3D()


@dataclass(frozen=True, slots=True)
class TimedGeometry3D(Struct):
    """Geometry3D, with its time."""

    tm: Time = Time()
    data: Geometry3D = Geometry3D()


@dataclass(frozen=True, slots=True)
class TimedCovariance3D(Struct):
    """Covariance3D, with its time."""

    tm: Time = Time()
    data: Covariance3D = Covariance3D()


@dataclass(frozen=True, slots=True)
class TimedSpeedHeading3D(Struct):
    """SpeedHeading3D, with its time."""

    tm: Time = Time()
    data: SpeedHeading3D = SpeedHeading3D()


@dataclass(frozen=True, slots=True)
class TimedOAP(Struct):
    """OAP, with its time."""

    tm: Time = Time()
    data: OAP = OAP()


@dataclass(frozen=True, slots=True)
class TimedQuaternion(Struct):
    """Quaternion, with its time."""

    tm: Time = Time()
    data: Quaternion = Quaternion()
