"""What a drive watches: its supply, its motor, and whether the motor follows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.ds402.motion.reference import Control
from tickrig.device.canopen.ds402.state.faults import ErrorCode

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402.drive import Ds402

OPEN_PHASE_SHARE: Final = 0.05
"""Below this share of the current limit no current flows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """What a drive takes for sound.

    Attributes:
        supply_mv: lowest and highest supply.
        winding_dc: highest temperature of the winding, in tenths of a degree Celsius.
        winding_warning_dc: from here on it warns.
        stall_us: how long the motor may stand at a limit although it shall turn.
    """

    supply_mv: tuple[int, int] = (9_000, 36_000)
    winding_dc: int = 1_250
    winding_warning_dc: int = 1_125
    stall_us: int = 1_000_000


class Supervision:
    """Finds faults by what the drive measures.

    Args:
        drive: the drive.
        bounds: what is sound.

    Attributes:
        has_supply: the supply is not too low (bit 4 of the statusword).
        waiting: a time-out runs.
        not_following: the following error is larger than 6065h.
    """

    def __init__(self, drive: Ds402, bounds: Bounds) -> None:
        self._drive, self.bounds = drive, bounds
        self.waiting = self.not_following = False
        self.has_supply = True
        self._error_us = self._stall_us = 0

    @property
    def warns(self) -> bool:
        """Whether the winding is warm (bit 7 of the statusword)."""
        return self._drive.motor.winding_dc >= self.bounds.winding_warning_dc

    def present(self) -> list[ErrorCode]:
        """Return the faults whose cause is there now."""
        motor, bounds = self._drive.motor, self.bounds
        supply_mv, (low, high) = motor.supply_mv, bounds.supply_mv
        found = self._drive.wired_faults()
        self.has_supply = supply_mv >= low
        if not self.has_supply:
            found.append(ErrorCode.UNDER_VOLTAGE)
        if supply_mv > high:
            found.append(ErrorCode.OVER_VOLTAGE)
        if motor.winding_dc > bounds.winding_dc:
            found.append(ErrorCode.DRIVE_TEMPERATURE)
        return found

    def find(self, now_us: int) -> list[ErrorCode]:
        """Return the faults that are there, and those that a motion with power shows."""
        found, self.waiting = self.present(), False
        if not self._drive.automaton.powered:
            self.not_following = False
            self._error_us = self._stall_us = now_us
            return found
        if self._loses_reference(now_us):
            found.append(ErrorCode.FOLLOWING_ERROR)
        if self._stalls(now_us):
            found.append(self._stall_code())
        return found

    def _loses_reference(self, now_us: int) -> bool:
        drive = self._drive
        window = drive.settings.following_error_window
        controlled = drive.control is Control.POSITION
        self.not_following = controlled and abs(drive.following_error) > window
        if not self.not_following:
            self._error_us = now_us
            return False
        self.waiting = True
        return now_us - self._error_us >= drive.settings.following_error_us

    def _stalls(self, now_us: int) -> bool:
        """Say whether the motor has stood for too long although it shall turn."""
        drive = self._drive
        shall_turn = drive.motor.current_limited or drive.axis.is_fast(drive.reference.velocity)
        if drive.control is Control.CURRENT or not (shall_turn and drive.axis.stands):
            self._stall_us = now_us
            return False
        self.waiting = True
        return now_us - self._stall_us >= self.bounds.stall_us

    def _stall_code(self) -> ErrorCode:
        motor = self._drive.motor
        flows = abs(motor.current_ma) > 1_000 * OPEN_PHASE_SHARE * motor.current_limit_a
        return ErrorCode.MOTOR_BLOCKED if flows else ErrorCode.MOTOR_PHASE
