# ruff: noqa: RUF009 - names as in the IDL, defaults are frozen
"""IIS.idl, version 1.0: common interfaces of mobile robots (RSi2/NEDO, mobile WG, 2010).

Map frame for poses, paths and goals, robot frame for velocities. `id` and
`error` are as each application wants.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from tickrig.wire.rtc_types.basic import Time
from tickrig.wire.rtc_types.extended_2d import Pose2D, Velocity2D
from tickrig.wire.rtc_types.idl import Double, Long, Struct


class IisStruct(Struct):
    """A struct of the module IIS."""

    __slots__ = ()
    idl_module: ClassVar[str] = "IIS"


@dataclass(frozen=True, slots=True)
class TimedPose2D(IisStruct):
    """The estimated pose of a robot, or how far it came on its path."""

    tm: Time = Time()
    id: tuple[Long, ...] = ()
    data: Pose2D = Pose2D()
    error: tuple[Double, ...] = ()


@dataclass(frozen=True, slots=True)
class TimedPath2DSeq(IisStruct):
    """A path: way points with the velocity at each; the first is the start, none means stop."""

    tm: Time = Time()
    id: tuple[Long, ...] = ()
    pose: tuple[Pose2D, ...] = ()
    velocity: tuple[Velocity2D, ...] = ()
    error: tuple[Double, ...] = ()


@dataclass(frozen=True, slots=True)
class TimedVelocity2D(IisStruct):
    """The velocity that is commanded, or measured."""

    tm: Time = Time()
    id: tuple[Long, ...] = ()
    data: Velocity2D = Velocity2D()
    error: tuple[Double, ...] = ()


@dataclass(frozen=True, slots=True)
class TimedPose2DSeq(IisStruct):
    """A goal: only the first pose counts, none clears it."""

    tm: Time = Time()
    id: tuple[Long, ...] = ()
    data: tuple[Pose2D, ...] = ()
    error: tuple[Double, ...] = ()
