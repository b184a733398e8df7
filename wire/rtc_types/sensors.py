# ruff: noqa: N815 - names as in the IDL, defaults are frozen
"""InterfaceDataTypes.idl of OpenRTM-aist 1.x: cameras, rangers, GPS and other sensors."""

from __future__ import annotations

from enum import IntEnum

from tickrig.wire.rtc_types.basic import Stamped
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


class BumperGeometry(Struct):
    """Geometry of a bumper; roc is its radius of curvature in m."""

    pose: Pose3D = Pose3D()
    size: Size3D = Size3D()
    roc: Double = 0.0


class BumperArrayGeometry(Struct):
    """Geometry of an array of bumpers."""

    arrayGeometry: Geometry3D = Geometry3D()
    bumperGeometry: tuple[BumperGeometry, ...] = ()


class CameraImage(Stamped):
    """An image; pixels divided by fDiv are real values."""

    width: UShort = 0
    height: UShort = 0
    bpp: UShort = 0
    format: String = ""
    fDiv: Double = 0.0
    pixels: OctetSeq = b""


class CameraInfo(Struct):
    """Lens of a camera: focal length in m, distortion coefficients."""

    focalLength: Vector2D = Vector2D()
    principalPoint: Point2D = Point2D()
    k1: Double = 0.0
    k2: Double = 0.0
    p1: Double = 0.0
    p2: Double = 0.0


class MultiCameraImages(Stamped):
    """Images of several cameras."""

    images: tuple[CameraImage, ...] = ()


class MulticameraGeometry(Struct):
    """Geometry of several cameras."""

    geometry: Geometry3D = Geometry3D()
    cameraGeometries: tuple[Geometry3D, ...] = ()


class FiducialInfo(Struct):
    """A fiducial that was detected."""

    id: ULong = 0
    pose: Pose3D = Pose3D()
    poseUncertainty: Pose3D = Pose3D()
    size: Size3D = Size3D()
    sizeUncertainty: Size3D = Size3D()


class Fiducials(Stamped):
    """All fiducials that were detected."""

    fiducialsList: tuple[FiducialInfo, ...] = ()


class FiducialFOV(Struct):
    """What a tracker of fiducials sees: m, m, rad."""

    minRange: Double = 0.0
    maxRange: Double = 0.0
    viewAngle: Double = 0.0


class GPSTime(Struct):
    """Time of a GPS receiver; msec is in us."""

    sec: ULong = 0
    msec: ULong = 0


class GPSFixType(IntEnum):
    """How good a position is."""

    GPS_FIX_NONE = 0
    GPS_FIX_NORMAL = 1
    GPS_FIX_DGPS = 2


class GPSData(Stamped):
    """Position of a GPS receiver: deg, deg, m, m, m, rad, m/s, m/s."""

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


class INSData(Stamped):
    """State of an inertial navigation system: deg, deg, m, m."""

    latitude: Double = 0.0
    longitude: Double = 0.0
    altitude: Double = 0.0
    heightAMSL: Double = 0.0
    velocityENU: Velocity3D = Velocity3D()
    orientation: Orientation3D = Orientation3D()


class PointCloudPoint(Struct):
    """A point and its colour."""

    point: Point3D = Point3D()
    colour: RGBColour = RGBColour()


class PointCloud(Stamped):
    """Points in space."""

    points: tuple[PointCloudPoint, ...] = ()


class RangerGeometry(Struct):
    """Geometry of a ranger and of its elements."""

    geometry: Geometry3D = Geometry3D()
    elementGeometries: tuple[Geometry3D, ...] = ()


class RangerConfig(Struct):
    """Limits of a ranger: rad, rad, rad, m, m, m, Hz."""

    minAngle: Double = 0.0
    maxAngle: Double = 0.0
    angularRes: Double = 0.0
    minRange: Double = 0.0
    maxRange: Double = 0.0
    rangeRes: Double = 0.0
    frequency: Double = 0.0


class RangeData(Stamped):
    """Ranges in m."""

    ranges: tuple[Double, ...] = ()
    geometry: RangerGeometry = RangerGeometry()
    config: RangerConfig = RangerConfig()


class IntensityData(Stamped):
    """Intensities, 0.0..1.0."""

    ranges: tuple[Double, ...] = ()
    geometry: RangerGeometry = RangerGeometry()
    config: RangerConfig = RangerConfig()
