"""Modes of operation of a drive (CiA 402-2): what it does in Operation enabled."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.ds402_state import Controlword, Statusword

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402 import Ds402

CURRENT_POSITION_METHODS: Final = (35, 37)
"""Homing methods that take the present position as home."""


class Mode:
    """No mode: the axis comes to a standstill.

    Attributes:
        flags: its bits in the statusword.
    """

    def __init__(self, drive: Ds402) -> None:
        self.drive, self.axis = drive, drive.axis
        self.flags = Statusword(0)

    def start(self) -> None:
        """Act on the rising edge of bit 4 of the controlword."""

    def stop(self) -> None:
        """Act on its falling edge."""

    def run(self) -> bool:
        """Make a step of a millisecond; say whether nothing is left to do."""
        return self._halt()

    def _halt(self) -> bool:
        self.axis.run(0, self.drive.deceleration)
        return self.axis.stands

    @property
    def _halted(self) -> bool:
        return bool(self.drive.controlword & Controlword.HALT)


class ProfilePosition(Mode):
    """Goes to set-points; one more set-point may wait for its turn.

    Not emulated: a target window, passing a set-point without a stop.
    """

    def __init__(self, drive: Ds402) -> None:
        super().__init__(drive)
        self._target, self._next = self.axis.position, self.axis.position
        self.flags = Statusword.TARGET_REACHED

    def start(self) -> None:
        """Take a new set-point and acknowledge it."""
        controlword, target = self.drive.controlword, self.drive.target_position
        if controlword & Controlword.RELATIVE:
            target += self._next
        self._next = target
        if controlword & Controlword.CHANGE_AT_ONCE or Statusword.TARGET_REACHED in self.flags:
            self._target = target
        self.flags = Statusword.MODE_12

    def stop(self) -> None:
        """Take the acknowledge back."""
        self.flags &= ~Statusword.MODE_12

    def run(self) -> bool:
        """Approach the set-point."""
        if self._halted:
            reached = self._halt()
        else:
            drive = self.drive
            reached = self.axis.approach(self._target, drive.profile_velocity, drive.acceleration)
            if reached and self._next != self._target:
                self._target, reached = self._next, False
        self.flags &= ~Statusword.TARGET_REACHED
        if reached:
            self.flags |= Statusword.TARGET_REACHED
        return reached


class ProfileVelocity(Mode):
    """Ramps to the target velocity."""

    def run(self) -> bool:
        """Accelerate or brake."""
        wanted = 0 if self._halted else self.drive.target_velocity
        reached = self.axis.run(wanted, self.drive.acceleration)
        self.flags = Statusword.TARGET_REACHED if reached else Statusword(0)
        if self.axis.stands:
            self.flags |= Statusword.MODE_12
        return reached and self.axis.stands


class Homing(Mode):
    """Homes at the present position; other methods are a homing error."""

    def start(self) -> None:
        """Home."""
        if self.drive.homing_method in CURRENT_POSITION_METHODS:
            self.axis.place(self.drive.home_offset)
            self.flags = Statusword.TARGET_REACHED | Statusword.MODE_12
        else:
            self.flags = Statusword.TARGET_REACHED | Statusword.MODE_13


class CyclicPosition(Mode):
    """Is where the target position says, without interpolation."""

    def run(self) -> bool:
        """Follow."""
        self.axis.place(self.drive.target_position)
        self.flags = Statusword.MODE_12
        return True


class CyclicVelocity(Mode):
    """Is as fast as the target velocity says."""

    def run(self) -> bool:
        """Follow."""
        self.axis.move(self.drive.target_velocity)
        self.flags = Statusword.MODE_12
        return self.axis.stands


MODES: Final[dict[int, type[Mode]]] = {
    0: Mode,
    1: ProfilePosition,
    3: ProfileVelocity,
    6: Homing,
    8: CyclicPosition,
    9: CyclicVelocity,
}
"""By the number in 6060h."""
