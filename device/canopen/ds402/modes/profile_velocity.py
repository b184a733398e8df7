"""Profile velocity mode (CiA 402-2)."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from tickrig.device.canopen.ds402.modes.mode import Mode
from tickrig.device.canopen.ds402.motion.reference import Control
from tickrig.device.canopen.ds402.motion.window import Window
from tickrig.device.canopen.ds402.state.state import Statusword

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402.drive import Ds402


class ProfileVelocity(Mode):
    """Ramps to the target velocity with 6083h and 6084h.

    Bit 10: the velocity is within 606Dh of the target for 606Eh; without a window,
    the ramp has ended. Bit 12: the speed is not above 606Fh for 6070h; without a
    threshold, it stands.

    Not emulated: the maximum slippage, bit 13; ramps of other shapes (6086h).
    """

    control: ClassVar[Control] = Control.VELOCITY

    def __init__(self, drive: Ds402) -> None:
        super().__init__(drive)
        self._arrived, self._slow = Window(), Window()

    def run(self, now_us: int) -> bool:
        """Accelerate or brake."""
        drive, settings = self.drive, self.drive.settings
        wanted = drive.target_velocity()
        ended = self.reference.ramp(wanted, settings.acceleration, settings.deceleration)
        self._tell(now_us, ended, wanted)
        return ended and not (self._arrived.waiting or self._slow.waiting)

    def halt(self, now_us: int) -> bool:
        """Brake as 605Dh says."""
        stands = self.drive.stopping.halt()
        self._tell(now_us, stands, 0.0)
        return stands and not (self._arrived.waiting or self._slow.waiting)

    def _tell(self, now_us: int, ended: bool, wanted: float) -> None:
        drive, settings = self.drive, self.drive.settings
        actual, window = drive.motor.velocity_counts_s, settings.velocity_window
        near = abs(actual - wanted) <= window if window else ended
        threshold = settings.velocity_threshold
        slow = abs(actual) <= threshold if threshold else self.reference.velocity == 0
        flags = Statusword(0)
        if self._arrived.holds(now_us, near, settings.velocity_window_us):
            flags |= Statusword.TARGET_REACHED
        if self._slow.holds(now_us, slow, settings.velocity_threshold_us):
            flags |= Statusword.MODE_12
        self.flags = flags
