"""Cyclic synchronous modes: a master gives a target with each SYNC (CiA 402-2)."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Final

from tickrig.device.canopen.ds402.modes.mode import Mode
from tickrig.device.canopen.ds402.modes.taken_target import TakenTarget
from tickrig.device.canopen.ds402.motion.reference import STEP_S, Control
from tickrig.device.canopen.ds402.objects import indices
from tickrig.device.canopen.ds402.state.state import Statusword

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402.drive import Ds402

STEP_US: Final = 1_000


class CyclicPosition(TakenTarget):
    """Goes to the target position within an interpolation period, on a straight line.

    A SYNC begins a line, and so does another target without SYNC. At the end of
    the line it stays.

    Not emulated: extrapolation when SYNC is late; the torque offset.
    """

    tells_following_error = True
    index = indices.TARGET_POSITION
    offset = indices.POSITION_OFFSET

    def __init__(self, drive: Ds402) -> None:
        super().__init__(drive)
        self.flags, self._left = Statusword.MODE_12, 0
        self._goal = self._ahead = 0.0

    def follow(self, now_us: int) -> bool:
        """Make a step along the line."""
        if self.drive.fresh:
            self._begin()
        if not self._left:
            self.reference.place(self.reference.position)
            return True
        self._step()
        self._left -= 1
        return False

    def _begin(self) -> None:
        drive = self.drive
        self._left = max(1, drive.settings.interpolation_us // STEP_US)
        offset = drive.parameters.number(indices.VELOCITY_OFFSET)
        self._goal, self._ahead = self.target(), offset * drive.settings.units.per_velocity

    def _step(self) -> None:
        drive, reference = self.drive, self.reference
        velocity = (self._goal - reference.position) / (self._left * STEP_S)
        most = drive.settings.max_velocity
        if abs(velocity) > most:
            velocity = most if velocity > 0 else -most
            drive.limited = True
        reference.place(reference.position + velocity * STEP_S, velocity + self._ahead)


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
