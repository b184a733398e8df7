"""What a drive watches: its supply, its motor, and whether the motor follows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tickrig.device.canopen.ds402.motion.axis import Axis
from tickrig.device.canopen.ds402.motion.reference import Control
from tickrig.device.canopen.ds402.objects.error_codes import ErrorCode
from tickrig.device.twin import Immutable, Part

OPEN_PHASE_SHARE: Final = 0.05
"""Below this share of the current limit no current flows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds(Immutable):
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


class Supervision(Part):
    """Finds faults by what the drive measures.

    Args:
        axis: what is watched.
        bounds: what is sound.

    Attributes:
        wired: faults that the electronics see, as their inputs are now.
        has_supply: the supply is not too low (bit 4 of the statusword).
        waiting: a time-out runs.
        not_following: the following error is larger than 6065h.
    """

    def __init__(self, axis: Axis, bounds: Bounds) -> None:
        self._axis, self.bounds = axis, bounds
        self.wired: tuple[ErrorCode, ...] = ()
        self.waiting = self.not_following = False
        self.has_supply = True
        self._error_us = self._stall_us = 0

    @property
    def warns(self) -> bool:
        """Whether the winding is warm (bit 7 of the statusword)."""
        return self._axis.motor.winding_dc >= self.bounds.winding_warning_dc

    def present(self, *, powered: bool) -> list[ErrorCode]:
        """Return the faults whose cause is there now; a short circuit needs power to be seen."""
        motor, bounds = self._axis.motor, self.bounds
        supply_mv, (lowest_mv, highest_mv) = motor.supply_mv, bounds.supply_mv
        found = [code for code in self.wired if powered or code is not ErrorCode.OVER_CURRENT]
        if supply_mv < lowest_mv:
            found.append(ErrorCode.UNDER_VOLTAGE)
        if supply_mv > highest_mv:
            found.append(ErrorCode.OVER_VOLTAGE)
        if motor.winding_dc > bounds.winding_dc:
            found.append(ErrorCode.DRIVE_TEMPERATURE)
        return found

    def step(self, now_us: int, *, powered: bool) -> list[ErrorCode]:
        """Watch for one tick.

        Returns:
            The faults that are there, and those that a motion with power shows.
        """
        found, self.waiting = self.present(powered=powered), False
        self.has_supply = ErrorCode.UNDER_VOLTAGE not in found
        if not powered:
            self.not_following = False
            self._error_us = self._stall_us = now_us
            return found
        if self._loses_reference(now_us):
            found.append(ErrorCode.FOLLOWING_ERROR)
        if self._stalls(now_us):
            found.append(self._stall_code())
        return found

    def skip(self, now_us: int) -> None:
        """Go on as after ticks up to `now_us` in which the motor followed."""
        self._error_us = self._stall_us = now_us

    def _loses_reference(self, now_us: int) -> bool:
        axis = self._axis
        controlled = axis.control is Control.POSITION
        window = axis.settings.following_error_window
        self.not_following = controlled and abs(axis.following_error) > window
        if not self.not_following:
            self._error_us = now_us
            return False
        self.waiting = True
        return now_us - self._error_us >= axis.settings.following_error_us

    def _stalls(self, now_us: int) -> bool:
        """Return whether the motor has stood for too long although it shall turn."""
        axis = self._axis
        shall_turn = axis.motor.current_limited or axis.is_fast(axis.reference.velocity)
        if axis.control is Control.CURRENT or not (shall_turn and axis.stands):
            self._stall_us = now_us
            return False
        self.waiting = True
        return now_us - self._stall_us >= self.bounds.stall_us

    def _stall_code(self) -> ErrorCode:
        motor = self._axis.motor
        flows = abs(motor.current_ma) > 1_000 * OPEN_PHASE_SHARE * motor.current_limit_a
        return ErrorCode.MOTOR_BLOCKED if flows else ErrorCode.MOTOR_PHASE
