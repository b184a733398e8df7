"""Interpolated position mode (CiA 402-2) with linear interpolation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tickrig.device.canopen.ds402.modes.cyclic import CyclicPosition
from tickrig.device.canopen.ds402.motion.stopping import Ramp
from tickrig.device.canopen.ds402.objects import indices
from tickrig.device.canopen.ds402.state.state import Statusword

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402.drive import Ds402


class InterpolatedPosition(CyclicPosition):
    """Goes to the data record 60C1h:01 within an interpolation period, on a straight line.

    It does so while bit 4 of the controlword is set; bit 12 of the statusword says
    that it does. Otherwise it brakes with the profile deceleration. A SYNC begins
    a line, and so does another record without SYNC. Bit 10: the line has ended.

    Not emulated: a buffer of records (60C4h); sub-modes beside 0 (60C0h).
    """

    halts = True
    tells_following_error = False
    index = indices.INTERPOLATION_DATA
    sub = 1
    offset = 0

    def __init__(self, drive: Ds402) -> None:
        super().__init__(drive)
        self._active = False

    def start(self) -> None:
        """Interpolate from now on."""
        self._active = True

    def stop(self) -> None:
        """Interpolate no longer."""
        self._active = False

    def run(self, now_us: int) -> bool:
        """Follow the line, or brake."""
        if not self._active:
            self._left, self.flags = 0, Statusword(0)
            return self.drive.stopping.brake(Ramp.SLOW_DOWN)
        settled = super().run(now_us)
        self.flags = Statusword.MODE_12 | (Statusword.TARGET_REACHED if settled else 0)
        return settled

    def halt(self, now_us: int) -> bool:
        """Brake as 605Dh says; the next record begins a line."""
        self._left, self.flags = 0, self.flags & ~Statusword.MODE_12
        return super().halt(now_us)
