# ruff: noqa: N815, RUF009 - names as in the IDL, defaults are frozen
"""InterfaceDataTypes.idl of OpenRTM-aist 1.x: cameras, rangers, GPS and other sensors."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from tickrig.wire.rtc_types.basic import Time
from tickrig.wire.rtc_types.extended_2d import Point2D, RGBColour, Vector2D
from tickrig.wire.rtc_types.extended_3d import (
    Geometry3D,
    Orientation3D,
    Point3D,
    Pose3D,
    Size3D,
    Velocity3D,
)
from tickrig.wire.rtc_types.idl import Double, OctetSeq, String, Struct, ULong, UShort


@dataclass(frozen=True, slots=True)
class BumperGeometry(Struct):
    """Geometry of a bumper; roc is its radius of curvature in m."""

    pose: Pose3D = Pose3D()
    size: Size3D = Size3D()
    roc: Double = 0.0


@dataclass(frozen=True, slots=True)
class BumperArrayGeometry(Struct):
    """Geometry of an array of bumpers."""

    arrayGeometry: Geometry3D = Geometry3D()
    bumperGeometry: tuple[BumperGeometry, ...] = ()


@dataclass(frozen=True, slots=True)
class CameraImage(Struct):
    """An image; pixels divided by fDiv are real values."""

    tm: Time = Time()
    width: UShort = 0
    height: UShort = 0
    bpp: UShort = 0
    format: String = ""
    fDiv: Double = 0.0
    pixels: OctetSeq = b""


@dataclass(frozen=True, slots=True)
class CameraInfo(Struct):
    """Lens of a camera: focal length in m, distortion coefficients."""

    focalLength: Vector2D = Vector2D()
    principalPoint: Point2D = Point2D()
    k1: Double = 0.0
    k2: Double = 0.0
    p1: Double = 0.0
    p2: Double = 0.0


@dataclass(frozen=True, slots=True)
class MultiCameraImages(Struct):
    """Images of several cameras."""

    tm: Time = Time()
    images: tuple[CameraImage, ...] = ()


@dataclass(frozen=True, slots=True)
class MulticameraGeometry(Struct):
    """Geometry of several cameras."""

    geometry: Geometry3D = Geometry3D()
    cameraGeometries: tuple[Geometry3D, ...] = ()


@dataclass(frozen=True, slots=True)
class FiducialInfo(Struct):
    """A fiducial that was detected."""

    id: ULong = 0
    pose: Pose3D = Pose3D()
    poseUncertainty: Pose3D = Pose3D()
    size: Size3D = Size3D()
    sizeUncertainty: Size3D = Size3D()


@dataclass(frozen=True, slots=True)
class Fiducials(Struct):
    """All fiducials that were detected."""

    tm: Time = Time()
    fiducialsList: tuple[FiducialInfo, ...] = ()


@dataclass(frozen=True, slots=True)
class FiducialFOV(Struct):
    """What a tracker of fiducials sees: m, m, rad."""

    minRange: Double = 0.0
    maxRange: Double = 0.0
    viewAngle: Double = 0.0


@dataclass(frozen=True, slots=True)
class GPSTime(Struct):
    """Time of a GPS receiver; msec is in us."""

    sec: ULong = 0
    msec: ULong = 0


class GPSFixType(IntEnum):
    """How good a position is."""

    GPS_FIX_NONE = 0
    GPS_FIX_NORMAL = 1
    GPS_FIX_DGPS = 2


@dataclass(frozen=True, slots=True)
class GPSData(Struct):
    """Position of a GPS receiver: deg, deg, m, m, m, rad, m/s, m/s."""

    tm: Time = Time()
    timeFromGPS: GPSTime = GPSTime()
    latitude: Double = 0.0
    longitude: Double = 0.0
    altitude: Double = 0.0
    horizontalError: Double = 0.0
    verticalError: Double = 0.0
    heading: Double = 0.0
    horizontalSpeed: Double = 0.0
    verticalSpeed: Double = 0.0
    numSatellites: UShort = 0
    fixType: GPSFixType = GPSFixType.GPS_FIX_NONE


@dataclass(frozen=True, slots=True)
class INSData(Struct):
    """State of an inertial navigation system: deg, deg, m, m."""

    tm: Time = Time()
    latitude: Double = 0.0
    longitude: Double = 0.0
    altitude: Double = 0.0
    heightAMSL: Double = 0.0
    velocityENU: Velocity3D = Velocity3D()
    orientation: Orientation3D = Orientation3D()


@dataclass(frozen=True, slots=True)
class PointCloudPoint(Struct):
    """A point and its colour."""

    point: Point3D = Point3D()
    colour: RGBColour = RGBColour()


@dataclass(frozen=True, slots=True)
class PointCloud(Struct):
    """Points in space."""

    tm: Time = Time()
    points: tuple[PointCloudPoint, ...] = ()


@dataclass(frozen=True, slots=True)
class RangerGeometry(Struct):
    """Geometry of a ranger and of its elements."""

    geometry: Geometry3D = Geometry3D()
    elementGeometries: tuple[Geometry3D, ...] = ()


@dataclass(frozen=True, slots=True)
class RangerConfig(Struct):
    """Limits of a ranger: rad, rad, rad, m, m, m, Hz."""

    minAngle: Double = 0.0
    maxAngle: Double = 0.0
    angularRes: Double = 0.0
    minRange: Double = 0.0
    maxRange: Double = 0.0
    rangeRes: Double = 0.0
    frequency: Double = 0.0


@dataclass(frozen=True, slots=True)
class RangeData(Struct):
    """Ranges in m."""

    tm: Time = Time()
    ranges: tuple[Double, ...] = ()
    geometry: RangerGeometry = RangerGeometry()
    config: RangerConfig = RangerConfig()


@dataclass(frozen=True, slots=True)
class IntensityData(Struct):
    """Intensities, 0.0..1.0."""

    tm: Time = Time()
    ranges: tuple[Double, ...] = ()
    geometry: RangerGeometry = RangerGeometry()
    config: RangerConfig = RangerConfig()
