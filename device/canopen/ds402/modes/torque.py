"""Profile torque mode and cyclic synchronous torque mode (CiA 402-2)."""

from __future__ import annotations

from typing import ClassVar

from tickrig.device.canopen.ds402.modes.mode import Mode
from tickrig.device.canopen.ds402.motion.reference import STEP_S, Control
from tickrig.device.canopen.ds402.objects import indices
from tickrig.device.canopen.ds402.state.state import Statusword


class ProfileTorque(Mode):
    """Ramps the current to the target torque, 6071h, with the slope 6087h.

    The torque is taken as the current: rated torque at rated current, without
    friction. Halt ramps it to zero. Bit 10: the ramp has ended.

    Not emulated: other torque profiles than the linear ramp (6088h).
    """

    control: ClassVar[Control] = Control.CURRENT

    def run(self, now_us: int) -> bool:
        """Ramp to the target."""
        return self._ramp(self.drive.target_current())

    def halt(self, now_us: int) -> bool:
        """Ramp to zero."""
        return self._ramp(0.0)

    def _ramp(self, wanted_a: float) -> bool:
        reference, most = self.reference, self.drive.settings.torque_slope_a_s * STEP_S
        away = wanted_a - reference.current_a
        if abs(away) <= most:
            reference.current_a, self.flags = wanted_a, Statusword.TARGET_REACHED
            return True
        reference.current_a += most if away > 0 else -most
        self.flags = Statusword(0)
        return False


class CyclicTorque(Mode):
    """Has the torque 6071h and the offset 60B2h at once.

    When the mode is chosen while the drive is enabled, the target torque becomes
    that of the motor.
    """

    control: ClassVar[Control] = Control.CURRENT
    halts = False

    def enter(self) -> None:
        """Take the present torque for the target, unless the drive is just being enabled."""
        drive = self.drive
        if drive.enabled:
            present = drive.axis.per_mille_of(self.reference.current_a)
            offset = drive.parameters.number(indices.TORQUE_OFFSET)
            drive.parameters.write(indices.TARGET_TORQUE, present - offset)

    def run(self, now_us: int) -> bool:
        """Follow."""
        drive = self.drive
        offset = drive.parameters.number(indices.TORQUE_OFFSET)
        self.reference.current_a = drive.target_current(offset)
        self.flags = Statusword.MODE_12
        return True
