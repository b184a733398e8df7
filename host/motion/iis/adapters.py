"""Components between the phases of the common interfaces, and between their heading ranges."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, Generic, TypeVar

from tickrig.host.motion.iis import conversions
from tickrig.host.motion.ports import arrived
from tickrig.host.rtc import ExecutionContext, InPort, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.wire.rtc_types import iis, iis_phase1, iis_phase2
from tickrig.wire.rtc_types.idl import Struct

S = TypeVar("S", bound=Struct)
T = TypeVar("T", bound=Struct)


class Adapter(RtComponent, Generic[S, T]):
    """Converts each value at its port `in` and writes it to `out`; what it cannot is left out.

    Args:
        instance_name: of the component.
        source: type of the values that arrive.
        target: type of those that leave.
        convert: makes one of the other.
    """

    def __init__(
        self,
        instance_name: str,
        source: type[S],
        target: type[T],
        convert: Callable[[S], T | None],
    ) -> None:
        super().__init__(instance_name)
        self.arriving = self.add_port(InPort("in", source))
        self.leaving = self.add_port(OutPort("out", target))
        self._convert = convert

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Convert what arrived."""
        for value in arrived(self.arriving):
            if (converted := self._convert(value)) is not None:
                self.leaving.write(converted)
        return ReturnCode.RTC_OK


class Velocity1To2(Adapter[iis_phase1.TimedVelocity, iis_phase2.TimedVelocity]):
    """A moving command of phase 1 for a robot of phase 2."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Velocity1To2", "IIS velocity, phase 1 to 2")

    def __init__(self, instance_name: str) -> None:
        source, target = iis_phase1.TimedVelocity, iis_phase2.TimedVelocity
        super().__init__(instance_name, source, target, conversions.velocity_1_to_2)


class Velocity2To1(Adapter[iis_phase2.TimedVelocity, iis_phase1.TimedVelocity]):
    """A moving command of phase 2 for a robot of phase 1; it does not go sideways."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Velocity2To1", "IIS velocity, phase 2 to 1")

    def __init__(self, instance_name: str) -> None:
        source, target = iis_phase2.TimedVelocity, iis_phase1.TimedVelocity
        super().__init__(instance_name, source, target, conversions.velocity_2_to_1)


class Velocity2To3(Adapter[iis_phase2.TimedVelocity, iis.TimedVelocity2D]):
    """A moving command of phase 2 for a robot of phase 3."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Velocity2To3", "IIS velocity, phase 2 to 3")

    def __init__(self, instance_name: str) -> None:
        source, target = iis_phase2.TimedVelocity, iis.TimedVelocity2D
        super().__init__(instance_name, source, target, conversions.velocity_2_to_3)


class Velocity3To2(Adapter[iis.TimedVelocity2D, iis_phase2.TimedVelocity]):
    """A moving command of phase 3 for a robot of phase 2."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Velocity3To2", "IIS velocity, phase 3 to 2")

    def __init__(self, instance_name: str) -> None:
        source, target = iis.TimedVelocity2D, iis_phase2.TimedVelocity
        super().__init__(instance_name, source, target, conversions.velocity_3_to_2)


class Position2To3(Adapter[iis_phase2.TimedPosition, iis.TimedPose2D]):
    """A self-position of phase 2 for those of phase 3."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Position2To3", "IIS self-position, phase 2 to 3")

    def __init__(self, instance_name: str) -> None:
        source, target = iis_phase2.TimedPosition, iis.TimedPose2D
        super().__init__(instance_name, source, target, conversions.position_2_to_3)


class Position3To2(Adapter[iis.TimedPose2D, iis_phase2.TimedPosition]):
    """A self-position of phase 3, or of RH3, for those of phase 2."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("Position3To2", "IIS self-position, phase 3 to 2")

    def __init__(self, instance_name: str) -> None:
        source, target = iis.TimedPose2D, iis_phase2.TimedPosition
        super().__init__(instance_name, source, target, conversions.position_3_to_2)


class PositiveHeading(Adapter[iis.TimedPose2D, iis.TimedPose2D]):
    """A pose of RH3 for an IIS interface: heading in 0..2 pi."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("PositiveHeading", "Heading in 0..2 pi")

    def __init__(self, instance_name: str) -> None:
        kind = iis.TimedPose2D
        super().__init__(instance_name, kind, kind, conversions.with_positive_heading)


class WrappedHeading(Adapter[iis.TimedPose2D, iis.TimedPose2D]):
    """A pose of an IIS interface for RH3: heading in -pi..pi."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("WrappedHeading", "Heading in -pi..pi")

    def __init__(self, instance_name: str) -> None:
        kind = iis.TimedPose2D
        super().__init__(instance_name, kind, kind, conversions.with_wrapped_heading)
