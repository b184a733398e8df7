"""Profile position and homing until their own modules are there."""

from __future__ import annotations

from typing import Final

from tickrig.device.canopen.ds402 import indices
from tickrig.device.canopen.ds402.mode import Mode
from tickrig.device.canopen.ds402.reference import STEP_S
from tickrig.device.canopen.ds402.state import Controlword, Statusword
from tickrig.device.canopen.ds402.trapezoid import Limits, Motion, to_position

CURRENT_POSITION_METHODS: Final = (35, 37)


class ProfilePosition(Mode):
    """Goes to set-points; one more set-point may wait for its turn."""

    tells_following_error = True

    def enter(self) -> None:
        """Stay."""
        self._target = self._next = self.drive.axis.position_of(self.reference.position)
        self.flags = Statusword.TARGET_REACHED

    def start(self) -> None:
        """Take a new set-point and acknowledge it."""
        controlword = self.drive.controlword
        target = self.drive.parameters.number(indices.TARGET_POSITION)
        if controlword & Controlword.RELATIVE:
            target += self._next
        self._next = target
        if controlword & Controlword.CHANGE_AT_ONCE or Statusword.TARGET_REACHED in self.flags:
            self._target = target
        self.flags = Statusword.MODE_12

    def stop(self) -> None:
        """Take the acknowledge back."""
        self.flags &= ~Statusword.MODE_12

    def run(self, now_us: int) -> bool:
        """Approach the set-point."""
        settings, reference = self.drive.settings, self.reference
        limits = Limits(settings.profile_velocity, settings.acceleration, settings.deceleration)
        start = Motion(reference.position, reference.velocity)
        path = to_position(now_us, start, self.drive.axis.counts_of(self._target), limits)
        reference.place(*path.at(now_us + round(STEP_S * 1_000_000)))
        reached = path.ended(now_us + 1_000)
        if reached and self._next != self._target:
            self._target, reached = self._next, False
        self.flags &= ~Statusword.TARGET_REACHED
        if reached:
            self.flags |= Statusword.TARGET_REACHED
        return reached


class Homing(Mode):
    """Homes at the present position; other methods are a homing error."""

    minds_limits = False

    def start(self) -> None:
        """Home."""
        number = self.drive.parameters.number
        if number(indices.HOMING_METHOD) in CURRENT_POSITION_METHODS:
            self.drive.axis.place_home(number(indices.HOME_OFFSET))
            self.flags = Statusword.TARGET_REACHED | Statusword.MODE_12
        else:
            self.flags = Statusword.TARGET_REACHED | Statusword.MODE_13

    def run(self, now_us: int) -> bool:
        """Stand."""
        return self.drive.stopping.halt()
