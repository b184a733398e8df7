"""Components between the phases of the common interfaces, and between their heading ranges.

What a phase cannot say is left out: sideways speed, `id` and `error` in phase 1. Headings
are in 0..2 pi on IIS interfaces, as they recommend, and in -pi..pi on those of RH3.
"""

from __future__ import annotations

from typing import ClassVar, Generic, TypeVar, get_args

from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion.geometry import Pose, positive
from tickrig.host.rtc.motion.ports import plausible, read_all, to_pose, to_pose_2d
from tickrig.wire.rtc_types import iis, rtc
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.rtc import Velocity2D

S = TypeVar("S", bound=Struct)
T = TypeVar("T", bound=Struct)


class Adapter(RtComponent, Generic[S, T]):
    """Converts each value at its port `in` and writes it to `out`; what it cannot is left out.

    A subclass names the types of both ports in brackets, and overrides `convert`.
    """

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        source, target = get_args(type(self).__orig_bases__[0])  # type: ignore[attr-defined]  # of the subclass
        self.arriving = self.add_port(InPort[S]("in", source))
        self.leaving = self.add_port(OutPort[T]("out", target))

    def convert(self, value: S) -> T | None:
        """Return a value that arrived as one that leaves, None if it cannot be."""
        raise NotImplementedError

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Convert what arrived."""
        for value in read_all(self.arriving):
            if (converted := self.convert(value)) is not None:
                self.leaving.write(converted)
        return ReturnCode.RTC_OK


class Velocity1To2(Adapter[rtc.TimedVelocity, iis.TimedVelocity]):
    """A moving command of phase 1 for a robot of phase 2."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Velocity1To2", "IIS velocity, phase 1 to 2")

    def convert(self, value: rtc.TimedVelocity) -> iis.TimedVelocity:
        """Return a velocity straight ahead."""
        return iis.TimedVelocity(value.tm, vx=value.v, w=value.w)


class Velocity2To1(Adapter[iis.TimedVelocity, rtc.TimedVelocity]):
    """A moving command of phase 2 for a robot of phase 1; it does not go sideways."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Velocity2To1", "IIS velocity, phase 2 to 1")

    def convert(self, value: iis.TimedVelocity) -> rtc.TimedVelocity:
        """Return a velocity without what goes sideways."""
        return rtc.TimedVelocity(value.tm, value.vx, value.w)


class Velocity2To3(Adapter[iis.TimedVelocity, iis.TimedVelocity2D]):
    """A moving command of phase 2 for a robot of phase 3."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Velocity2To3", "IIS velocity, phase 2 to 3")

    def convert(self, value: iis.TimedVelocity) -> iis.TimedVelocity2D:
        """Return the same velocity."""
        data = Velocity2D(value.vx, value.vy, value.w)
        return iis.TimedVelocity2D(value.tm, value.id, data, value.error)


class Velocity3To2(Adapter[iis.TimedVelocity2D, iis.TimedVelocity]):
    """A moving command of phase 3 for a robot of phase 2."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Velocity3To2", "IIS velocity, phase 3 to 2")

    def convert(self, value: iis.TimedVelocity2D) -> iis.TimedVelocity:
        """Return the same velocity."""
        data = value.data
        return iis.TimedVelocity(value.tm, value.id, data.vx, data.vy, data.va, value.error)


class Position2To3(Adapter[iis.TimedPosition, iis.TimedPose2D]):
    """A self-position of phase 2 for those of phase 3."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Position2To3", "IIS self-position, phase 2 to 3")

    def convert(self, value: iis.TimedPosition) -> iis.TimedPose2D | None:
        """Return the same pose, heading in 0..2 pi; None if a number is none."""
        if not plausible(value.x, value.y, value.theta):
            return None
        pose = Pose(value.x, value.y, positive(value.theta))
        return iis.TimedPose2D(value.tm, value.id, to_pose_2d(pose), value.error)


class Position3To2(Adapter[iis.TimedPose2D, iis.TimedPosition]):
    """A self-position of phase 3, or of RH3, for those of phase 2."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Position3To2", "IIS self-position, phase 3 to 2")

    def convert(self, value: iis.TimedPose2D) -> iis.TimedPosition | None:
        """Return the same pose, heading in 0..2 pi; None if a number is none."""
        if (pose := to_pose(value.data)) is None:
            return None
        numbers = (pose.x, pose.y, positive(pose.heading))
        return iis.TimedPosition(value.tm, value.id, *numbers, value.error)


class PositiveHeading(Adapter[iis.TimedPose2D, iis.TimedPose2D]):
    """A pose of RH3 for an IIS interface: heading in 0..2 pi."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("PositiveHeading", "Heading in 0..2 pi")

    def convert(self, value: iis.TimedPose2D) -> iis.TimedPose2D | None:
        """Return the pose with its heading in 0..2 pi; None if a number is none."""
        if (pose := to_pose(value.data)) is None:
            return None
        data = to_pose_2d(pose._replace(heading=positive(pose.heading)))
        return iis.TimedPose2D(value.tm, value.id, data, value.error)


class WrappedHeading(Adapter[iis.TimedPose2D, iis.TimedPose2D]):
    """A pose of an IIS interface for RH3: heading in -pi..pi."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("WrappedHeading", "Heading in -pi..pi")

    def convert(self, value: iis.TimedPose2D) -> iis.TimedPose2D | None:
        """Return the pose with its heading in -pi..pi; None if a number is none."""
        return with_wrapped_heading(value)


def with_wrapped_heading(value: iis.TimedPose2D) -> iis.TimedPose2D | None:
    """Return a pose with its heading in -pi..pi; None if a number is none."""
    pose = to_pose(value.data)
    return pose and iis.TimedPose2D(value.tm, value.id, to_pose_2d(pose), value.error)
