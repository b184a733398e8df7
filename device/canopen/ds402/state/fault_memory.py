"""The faults of a drive since the last reset (CiA 402-2, state Fault; 603Fh)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from tickrig.device.canopen.ds402.objects import indices
from tickrig.device.canopen.ds402.state.faults import register_of
from tickrig.device.canopen.ds402.state.state import DriveState

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402.drive import Ds402


class FaultMemory:
    """Keeps the codes of faults until their causes are gone and somebody resets them."""

    def __init__(self, drive: Ds402) -> None:
        self._drive = drive
        self._codes: list[int] = []

    def forget(self) -> None:
        """Forget all, as after a start."""
        self._codes = []

    def take(self, code: int) -> None:
        """Have a fault, and say so with its emergency error code."""
        if code not in self._codes:
            self.note(code)
            self._drive.node.emergency(code, register_of(code))

    def note(self, code: int) -> None:
        """Have a fault that was told already."""
        drive = self._drive
        self._codes.append(code)
        drive.parameters.write(indices.ERROR_CODE, code)
        drive.automaton.react(code)
        drive.request()

    def reset(self, present: Iterable[int]) -> None:
        """Leave Fault if none of these causes has left a code here: transition 15."""
        if not set(present).isdisjoint(self._codes):
            return
        drive = self._drive
        for code in self._codes:
            drive.node.emergency_clear(code)
        self._codes = []
        drive.parameters.write(indices.ERROR_CODE, 0)
        drive.automaton.enter(DriveState.SWITCH_ON_DISABLED)
