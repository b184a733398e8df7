"""What a drive does when it loses its master (CiA 402-2, 6007h)."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.ds402.objects import indices
from tickrig.device.canopen.ds402.state.faults import COMMUNICATION_ERRORS, ErrorCode
from tickrig.device.canopen.ds402.state.state import DriveState

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402.drive import Ds402

MINDING: Final = (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE)
"""States in which the motor has power."""


class AbortConnection(IntEnum):
    """What a lost connection does (6007h)."""

    NO_ACTION = 0
    FAULT = 1
    DISABLE_VOLTAGE = 2
    QUICK_STOP = 3


class Connection:
    """The way to the master, as heartbeat, guarding and RPDOs show it.

    Attributes:
        lost: emergency error codes of what is missing.
    """

    def __init__(self, drive: Ds402) -> None:
        self._drive = drive
        self.lost: set[int] = set()

    def lose(self, code: int) -> None:
        """Remember an emergency that means a lost connection."""
        if code in COMMUNICATION_ERRORS:
            self.lost.add(code)

    def abort(self) -> None:
        """Act as 6007h says, while the motor has power."""
        drive = self._drive
        if drive.state not in MINDING:
            return
        match drive.parameters.number(indices.ABORT_CONNECTION):
            case AbortConnection.FAULT:
                drive.faults.note(max(self.lost, default=ErrorCode.COMMUNICATION))
            case AbortConnection.DISABLE_VOLTAGE:
                drive.automaton.enter(DriveState.SWITCH_ON_DISABLED)
            case AbortConnection.QUICK_STOP:
                drive.automaton.enter(DriveState.QUICK_STOP_ACTIVE)
            case _:  # no action, or what a manufacturer might mean
                return
        drive.request()
