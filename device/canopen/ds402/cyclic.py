"""Cyclic synchronous modes: a master gives a target with each SYNC (CiA 402-2)."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Final

from tickrig.device.canopen.ds402 import indices
from tickrig.device.canopen.ds402.mode import Mode
from tickrig.device.canopen.ds402.reference import STEP_S, Control
from tickrig.device.canopen.ds402.state import Statusword

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402.drive import Ds402

STEP_US: Final = 1_000


class CyclicPosition(Mode):
    """Goes to the target position within an interpolation period, on a straight line.

    A SYNC begins a line, and so does another target without SYNC. At the end of
    the line it stays. When the mode begins, the target position becomes that of
    the reference, so that nothing moves before the master says so.

    Not emulated: extrapolation when SYNC is late; the torque offset.
    """

    halts = False
    tells_following_error = True

    def __init__(self, drive: Ds402) -> None:
        super().__init__(drive)
        self._left = 0

    def enter(self) -> None:
        """Take the present position for the target."""
        self.drive.parameters.write(indices.TARGET_POSITION, self._present)

    @property
    def _present(self) -> int:
        offset = self.drive.parameters.number(indices.POSITION_OFFSET)
        return self.drive.axis.position_of(self.reference.position) - offset

    def run(self, now_us: int) -> bool:
        """Follow the line."""
        drive, reference = self.drive, self.reference
        if drive.fresh:
            self._left = max(1, drive.settings.interpolation_us // STEP_US)
        self.flags = Statusword.MODE_12
        if self._left:
            self._step(self._target())
            self._left -= 1
            return False
        reference.place(reference.position)
        return True

    def _target(self) -> float:
        drive = self.drive
        number = drive.parameters.number
        position = number(indices.TARGET_POSITION) + number(indices.POSITION_OFFSET)
        return drive.within(drive.axis.counts_near(position))

    def _step(self, target: float) -> None:
        drive, reference = self.drive, self.reference
        velocity = (target - reference.position) / (self._left * STEP_S)
        most = drive.settings.max_velocity
        if abs(velocity) > most:
            velocity = most if velocity > 0 else -most
            drive.limited = True
        offset = drive.parameters.number(indices.VELOCITY_OFFSET)
        ahead = velocity + offset * drive.settings.units.per_velocity
        reference.place(reference.position + velocity * STEP_S, ahead)


class CyclicVelocity(Mode):
    """Has the target velocity at the end of an interpolation period, on a straight ramp.

    When the mode is chosen while the drive is enabled, the target velocity becomes
    that of the reference.
    """

    control: ClassVar[Control] = Control.VELOCITY
    halts = False

    def __init__(self, drive: Ds402) -> None:
        super().__init__(drive)
        self._slope = 0.0

    def enter(self) -> None:
        """Take the present velocity for the target, unless the drive is just being enabled."""
        if self.drive.enabled:
            self.drive.parameters.write(indices.TARGET_VELOCITY, self._present)

    @property
    def _present(self) -> int:
        drive = self.drive
        velocity = round(self.reference.velocity / drive.settings.units.per_velocity)
        return velocity - drive.parameters.number(indices.VELOCITY_OFFSET)

    def run(self, now_us: int) -> bool:
        """Follow the ramp."""
        drive, settings = self.drive, self.drive.settings
        wanted = drive.target_velocity(drive.parameters.number(indices.VELOCITY_OFFSET))
        if drive.fresh or not self._slope:
            away = abs(wanted - self.reference.velocity)
            self._slope = away * 1_000_000 / settings.interpolation_us or 1.0
        reached = self.reference.ramp(
            wanted,
            min(self._slope, settings.max_acceleration),
            min(self._slope, settings.max_deceleration),
        )
        self.flags = Statusword.MODE_12
        return reached
