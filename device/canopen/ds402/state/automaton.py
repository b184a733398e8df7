"""The state of a drive at work: who changes it, and what it does (CiA 402-2)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.ds402.objects import indices
from tickrig.device.canopen.ds402.state.faults import is_controllable
from tickrig.device.canopen.ds402.state.state import NEXT_STATE, POWERED, Command, DriveState

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402.drive import Ds402

RAMPS: Final = {
    DriveState.SWITCHED_ON: indices.DISABLE_OPERATION_OPTION,
    DriveState.READY_TO_SWITCH_ON: indices.SHUTDOWN_OPTION,
}
"""Option codes that say how Operation enabled is left: transitions 5 and 8."""


class Automaton:
    """Transitions 5 and 8 are made when the motor stands, if their option says so.

    Args:
        drive: whose state it is.

    Attributes:
        state: the present state.
    """

    def __init__(self, drive: Ds402) -> None:
        self._drive = drive
        self.state = DriveState.NOT_READY_TO_SWITCH_ON
        self._leaving: DriveState | None = None
        self._severe = False

    @property
    def powered(self) -> bool:
        """Whether the motor may have torque."""
        return self.state in POWERED

    def restart(self) -> None:
        """Be as after power-on."""
        self.state, self._leaving = DriveState.NOT_READY_TO_SWITCH_ON, None

    def obey(self, command: Command) -> None:
        """Make the transition that a controlword asks for, if there is one."""
        if self.state is DriveState.OPERATION_ENABLED:
            self._leaving = None
        following = NEXT_STATE.get((self.state, command))
        if following is None or self._must_finish(following):
            return
        if self.state is DriveState.OPERATION_ENABLED and following in RAMPS:
            self._leaving = following
        else:
            self.enter(following)

    def enter(self, state: DriveState) -> None:
        """Change the state."""
        if state is DriveState.OPERATION_ENABLED:
            self._drive.begin_mode()
        self.state, self._leaving = state, None

    def react(self, code: int) -> None:
        """React to a fault: transition 13."""
        severe = not (is_controllable(code) and self.powered)
        if self.state is DriveState.FAULT_REACTION_ACTIVE:
            self._severe |= severe
        elif self.state is not DriveState.FAULT:
            self._severe = severe
            self.enter(DriveState.FAULT_REACTION_ACTIVE)

    def run(self, now_us: int) -> bool:
        """Do what the state does for a step; say whether nothing is left to do."""
        match self.state:
            case DriveState.NOT_READY_TO_SWITCH_ON:
                self.enter(DriveState.SWITCH_ON_DISABLED)
            case DriveState.OPERATION_ENABLED:
                return self._operate(now_us)
            case DriveState.QUICK_STOP_ACTIVE:
                return self._quick_stop()
            case DriveState.FAULT_REACTION_ACTIVE:
                return self._slow_down()
            case _:
                pass
        return True

    def _must_finish(self, following: DriveState) -> bool:
        """Say whether a quick stop cannot be left for Operation enabled: transition 16."""
        return (
            self.state is DriveState.QUICK_STOP_ACTIVE
            and following is DriveState.OPERATION_ENABLED
            and not self._drive.stopping.stays
        )

    def _operate(self, now_us: int) -> bool:
        leaving = self._leaving
        if leaving is None:
            return self._drive.operate(now_us)
        stands = self._drive.stopping.by(RAMPS[leaving])
        if stands:
            self.enter(leaving)
        return stands

    def _quick_stop(self) -> bool:
        stopping = self._drive.stopping
        stands = stopping.quick_stop()
        if stands and not stopping.stays:
            self.enter(DriveState.SWITCH_ON_DISABLED)
        return stands

    def _slow_down(self) -> bool:
        stands = self._severe or self._drive.stopping.by(indices.FAULT_REACTION_OPTION)
        if stands:
            self.enter(DriveState.FAULT)
        return stands
