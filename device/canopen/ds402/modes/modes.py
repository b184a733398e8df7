"""Modes of operation by their number in 6060h (CiA 402-2)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Final

from tickrig.device.canopen.ds402 import indices
from tickrig.device.canopen.ds402.axis import STEP_S, Control
from tickrig.device.canopen.ds402.modes.cyclic import (
    CyclicPosition,
    CyclicVelocity,
    InterpolatedPosition,
)
from tickrig.device.canopen.ds402.modes.homing import Homing
from tickrig.device.canopen.ds402.modes.mode import DriveView, Mode, ModeBit, Window
from tickrig.device.canopen.ds402.modes.profile_position import ProfilePosition

# Profile velocity, profile torque and cyclic synchronous torque mode (CiA 402-2).


class _ProfileVelocity(Mode):
    """Ramps to the target velocity with 6083h and 6084h.

    Bit 10 is set when the velocity has been within the window 606Dh of the target for the time
    606Eh, or without a window when the ramp has ended. Bit 12 is set when the speed has not been
    above the threshold 606Fh for the time 6070h, or without a threshold when the motor stands.

    Not emulated: the maximum slippage (bit 13); ramps of other shapes (6086h).
    """

    control: ClassVar[Control] = Control.VELOCITY

    def __init__(self, drive: DriveView) -> None:
        super().__init__(drive)
        self._arrived, self._slow = Window(), Window()

    def run(self, now_us: int) -> bool:
        """Accelerate or brake."""
        settings = self.settings
        wanted = self.target_velocity()
        ended = self.reference.ramp(wanted, settings.acceleration, settings.deceleration)
        self._show(now_us, ended, wanted)
        return ended and not (self._arrived.waiting or self._slow.waiting)

    def halt(self, now_us: int) -> bool:
        """Brake according to 605Dh."""
        stands = self.drive.stopping.by(indices.HALT_OPTION)
        self._show(now_us, stands, 0.0)
        return stands and not (self._arrived.waiting or self._slow.waiting)

    def _show(self, now_us: int, ended: bool, wanted: float) -> None:
        settings = self.settings
        actual, window = self.axis.motor.velocity_counts_s, settings.velocity_window
        near = abs(actual - wanted) <= window if window else ended
        threshold = settings.velocity_threshold
        slow = abs(actual) <= threshold if threshold else self.reference.velocity == 0
        flags = 0
        if self._arrived.holds(now_us, near, settings.velocity_window_us):
            flags |= ModeBit.TARGET_REACHED
        if self._slow.holds(now_us, slow, settings.velocity_threshold_us):
            flags |= ModeBit.MODE_12
        self.flags = flags


class _ProfileTorque(Mode):
    """Ramps the current to the target torque, 6071h, with the slope 6087h.

    The torque is proportional to the current: rated torque at rated current, without friction. Halt
    ramps the torque to zero. Bit 10 is set when the ramp has ended.

    Not emulated: torque profiles other than the linear ramp (6088h).
    """

    control: ClassVar[Control] = Control.CURRENT

    def run(self, now_us: int) -> bool:
        """Ramp to the target."""
        return self._ramp(self.target_current())

    def halt(self, now_us: int) -> bool:
        """Ramp to zero."""
        return self._ramp(0.0)

    def _ramp(self, wanted_a: float) -> bool:
        reference, most = self.reference, self.settings.torque_slope_a_s * STEP_S
        away = wanted_a - reference.current_a
        if abs(away) <= most:
            reference.current_a, self.flags = wanted_a, ModeBit.TARGET_REACHED
            return True
        reference.current_a += most if away > 0 else -most
        self.flags = 0
        return False


class _CyclicTorque(Mode):
    """Applies the torque 6071h plus the offset 60B2h at once.

    When the mode is chosen while the drive is enabled, the target torque becomes the torque of
    the motor.
    """

    control: ClassVar[Control] = Control.CURRENT
    halts = False

    def enter(self, *, enabled: bool) -> None:
        """Use the present torque as target, unless the drive is just being enabled."""
        if enabled:
            present = self.axis.per_mille_of(self.reference.current_a)
            offset = self.number(indices.TORQUE_OFFSET)
            self.drive.parameters.write(indices.TARGET_TORQUE, present - offset)

    def run(self, now_us: int) -> bool:
        """Apply the target torque."""
        self.reference.current_a = self.target_current(self.number(indices.TORQUE_OFFSET))
        self.flags = ModeBit.MODE_12
        return True


MODES: Final[dict[int, type[Mode]]] = {
    0: Mode,
    1: ProfilePosition,
    3: _ProfileVelocity,
    4: _ProfileTorque,
    6: Homing,
    7: InterpolatedPosition,
    8: CyclicPosition,
    9: CyclicVelocity,
    10: _CyclicTorque,
}
"""Modes of any drive; a model may add modes with negative numbers."""


def offered(modes: Mapping[int, type[Mode]], listed: int) -> Mapping[int, type[Mode]]:
    """Return those modes of operation that the drive supports according to its object 6502h.

    Args:
        modes: all modes by their number. A mode of a manufacturer has a negative number and is
            always returned.
        listed: value of 6502h, or 0 to return all modes.

    >>> sorted(offered(MODES, 0b101))
    [0, 1, 3]
    """
    return {n: mode for n, mode in modes.items() if n <= 0 or not listed or listed >> n - 1 & 1}


def supported(modes: Mapping[int, type[Mode]]) -> int:
    """Return the value of 6502h: bit n - 1 for mode n.

    >>> hex(supported(MODES))
    '0x3ed'
    """
    return sum(1 << number - 1 for number in modes if number > 0)
