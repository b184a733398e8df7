# ruff: noqa: N815 - names as in the IDL, defaults are frozen
"""InterfaceDataTypes.idl of OpenRTM-aist 1.x: localisation, maps, paths."""

from __future__ import annotations

from tickrig.wire.rtc_types.basic import Stamped, Time
from tickrig.wire.rtc_types.extended_2d import (
    Covariance2D,
    Point2D,
    PointCovariance2D,
    Pose2D,
    Velocity2D,
)
from tickrig.wire.rtc_types.extended_3d import Covariance3D, Pose3D, Velocity3D
from tickrig.wire.rtc_types.idl import Boolean, Double, OctetSeq, Struct, ULong


class Hypothesis2D(Struct):
    """Where a robot may be in the plane."""

    mean: Pose2D = Pose2D()
    covariance: Covariance2D = Covariance2D()
    weight: Double = 0.0


class Hypotheses2D(Stamped):
    """All places where a robot may be in the plane."""

    hypotheses: tuple[Hypothesis2D, ...] = ()


class Hypothesis3D(Struct):
    """Where a robot may be in space."""

    mean: Pose3D = Pose3D()
    covariance: Covariance3D = Covariance3D()
    weight: Double = 0.0


class Hypotheses3D(Stamped):
    """All places where a robot may be in space."""

    hypotheses: tuple[Hypothesis3D, ...] = ()


class OGMapConfig(Struct):
    """Scale in m per cell, size and origin of an occupancy grid map."""

    xScale: Double = 0.0
    yScale: Double = 0.0
    width: ULong = 0
    height: ULong = 0
    origin: Pose2D = Pose2D()


class OGMapTile(Struct):
    """Part of an occupancy grid map, row by row."""

    column: ULong = 0
    row: ULong = 0
    width: ULong = 0
    height: ULong = 0
    cells: OctetSeq = b""


class PointFeature(Struct):
    """A point on a map."""

    probability: Double = 0.0
    position: Point2D = Point2D()
    covariance: PointCovariance2D = PointCovariance2D()


class PoseFeature(Struct):
    """A point with a direction on a map."""

    probability: Double = 0.0
    position: Pose2D = Pose2D()
    covariance: Covariance2D = Covariance2D()


class LineFeature(Struct):
    """A line on a map: rho in m, alpha in rad."""

    probability: Double = 0.0
    rho: Double = 0.0
    alpha: Double = 0.0
    covariance: PointCovariance2D = PointCovariance2D()
    start: Point2D = Point2D()
    end: Point2D = Point2D()
    startSighted: Boolean = False
    endSighted: Boolean = False


class Features(Stamped):
    """All features of a map."""

    pointFeatures: tuple[PointFeature, ...] = ()
    poseFeatures: tuple[PoseFeature, ...] = ()
    lineFeatures: tuple[LineFeature, ...] = ()


class Waypoint2D(Struct):
    """A way point in the plane: m, rad."""

    target: Pose2D = Pose2D()
    distanceTolerance: Double = 0.0
    headingTolerance: Double = 0.0
    timeLimit: Time = Time()
    maxSpeed: Velocity2D = Velocity2D()


class Path2D(Stamped):
    """A path in the plane."""

    waypoints: tuple[Waypoint2D, ...] = ()


class Waypoint3D(Struct):
    """A way point in space: m, rad."""

    target: Pose3D = Pose3D()
    distanceTolerance: Double = 0.0
    headingTolerance: Double = 0.0
    timeLimit: Time = Time()
    maxSpeed: Velocity3D = Velocity3D()


class Path3D(Stamped):
    """A path in space."""

    waypoints: tuple[Waypoint3D, ...] = ()
