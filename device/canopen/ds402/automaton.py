"""The state machine of a drive (CiA 402-2), and its supervision."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from tickrig.device.canopen.ds402 import indices
from tickrig.device.canopen.ds402.axis import Axis, Control, Stopping
from tickrig.device.canopen.ds402.settings import ErrorCode, is_controllable
from tickrig.device.twin import Immutable, Part
from tickrig.wire.canopen.drive import DriveState

# The state machine of a drive, and what the drive does in each state (CiA 402-2).


class Command(Enum):
    """Commands of a controlword. The command "switch on" also means "disable operation"."""

    SHUTDOWN = auto()
    SWITCH_ON = auto()
    ENABLE_OPERATION = auto()
    DISABLE_VOLTAGE = auto()
    QUICK_STOP = auto()


_COMMANDS: Final = (
    (0x87, 0x06, Command.SHUTDOWN),
    (0x8F, 0x07, Command.SWITCH_ON),
    (0x8F, 0x0F, Command.ENABLE_OPERATION),
    (0x82, 0x00, Command.DISABLE_VOLTAGE),
    (0x86, 0x02, Command.QUICK_STOP),
)
"""Mask, value and command of a controlword."""

_SOD: Final = DriveState.SWITCH_ON_DISABLED
_READY: Final = DriveState.READY_TO_SWITCH_ON
_ON: Final = DriveState.SWITCHED_ON
_ENABLED: Final = DriveState.OPERATION_ENABLED
_QUICK_STOP: Final = DriveState.QUICK_STOP_ACTIVE

NEXT_STATE: Final = {
    (_SOD, Command.SHUTDOWN): _READY,  # transition 2
    (_READY, Command.SWITCH_ON): _ON,  # 3
    (_READY, Command.ENABLE_OPERATION): _ENABLED,  # 3, then 4 by itself
    (_READY, Command.DISABLE_VOLTAGE): _SOD,  # 7
    (_READY, Command.QUICK_STOP): _SOD,  # 7
    (_ON, Command.ENABLE_OPERATION): _ENABLED,  # 4
    (_ON, Command.SHUTDOWN): _READY,  # 6
    (_ON, Command.DISABLE_VOLTAGE): _SOD,  # 10
    (_ON, Command.QUICK_STOP): _SOD,  # 10
    (_ENABLED, Command.SWITCH_ON): _ON,  # 5
    (_ENABLED, Command.SHUTDOWN): _READY,  # 8
    (_ENABLED, Command.DISABLE_VOLTAGE): _SOD,  # 9
    (_ENABLED, Command.QUICK_STOP): _QUICK_STOP,  # 11
    (_QUICK_STOP, Command.DISABLE_VOLTAGE): _SOD,  # 12
    (_QUICK_STOP, Command.ENABLE_OPERATION): _ENABLED,  # 16, if 605Ah lets it stay
}
"""Next state by (state, command), without transitions 0, 1, 13, 14 (drive) and 15 (fault reset)."""

_POWERED: Final = (_ENABLED, _QUICK_STOP, DriveState.FAULT_REACTION_ACTIVE)
"""States in which the motor may have torque."""

_RAMPS: Final = {
    DriveState.SWITCHED_ON: indices.DISABLE_OPERATION_OPTION,
    DriveState.READY_TO_SWITCH_ON: indices.SHUTDOWN_OPTION,
}
"""Option codes for leaving Operation enabled by transitions 5 and 8."""


def command_of(controlword: int) -> Command | None:
    """Return the command of a controlword, or None if there is none.

    >>> command_of(0x0006), command_of(0x0080)
    (<Command.SHUTDOWN: 1>, None)
    """
    for mask, value, command in _COMMANDS:
        if controlword & mask == value:
            return command
    return None


class Automaton(Part):
    """The state machine of a drive (CiA 402), which follows the controlword and faults.

    The drive leaves the state "Operation enabled" by transition 5 to "Switched on", or by
    transition 8 to "Ready to switch on". If the option codes require it, the motor is braked before
    these transitions.

    Args:
        stopping: object that brakes according to the option codes.
        begin_mode: function that begins the chosen mode of operation.

    Attributes:
        state: the present state.
    """

    def __init__(self, stopping: Stopping, begin_mode: Callable[[], None]) -> None:
        self._stopping, self._begin_mode = stopping, begin_mode
        self.state = DriveState.NOT_READY_TO_SWITCH_ON
        self._leaving: DriveState | None = None
        self._severe = False

    @property
    def powered(self) -> bool:
        """Whether the motor may have torque."""
        return self.state in _POWERED

    @property
    def operating(self) -> bool:
        """Whether the mode of operation is active, and is not being left."""
        return self.state is DriveState.OPERATION_ENABLED and self._leaving is None

    def restart(self) -> None:
        """Restore the state after power-on."""
        self.state, self._leaving = DriveState.NOT_READY_TO_SWITCH_ON, None

    def obey(self, command: Command) -> None:
        """Make the state transition that a command of the controlword causes.

        The command has no effect if the present state has no transition for it.
        """
        if self.state is DriveState.OPERATION_ENABLED:
            self._leaving = None
        following = NEXT_STATE.get((self.state, command))
        if following is None or self._must_finish(following):
            return
        if self.state is DriveState.OPERATION_ENABLED and following in _RAMPS:
            self._leaving = following
        else:
            self.enter(following)

    def enter(self, state: DriveState) -> None:
        """Change the state."""
        if state is DriveState.OPERATION_ENABLED:
            self._begin_mode()
        self.state, self._leaving = state, None

    def react(self, code: int) -> None:
        """React to a fault: transition 13."""
        severe = not (is_controllable(code) and self.powered)
        if self.state is DriveState.FAULT_REACTION_ACTIVE:
            self._severe |= severe
        elif self.state is not DriveState.FAULT:
            self._severe = severe
            self.enter(DriveState.FAULT_REACTION_ACTIVE)

    def run(self) -> bool:
        """Run one control period of the state machine, for example a period of a quick stop.

        The drive calls this method in each control period in which no mode of operation is active.

        Returns:
            True if the drive has no work until an input changes.
        """
        if self._leaving is not None:
            return self._leave(self._leaving)
        match self.state:
            case DriveState.NOT_READY_TO_SWITCH_ON:
                self.enter(DriveState.SWITCH_ON_DISABLED)
            case DriveState.QUICK_STOP_ACTIVE:
                return self._quick_stop()
            case DriveState.FAULT_REACTION_ACTIVE:
                return self._slow_down()
            case _:
                pass
        return True

    def _must_finish(self, following: DriveState) -> bool:
        """Return whether the option code forbids transition 16: quick stop to Operation enabled."""
        return (
            self.state is DriveState.QUICK_STOP_ACTIVE
            and following is DriveState.OPERATION_ENABLED
            and not self._stopping.stays
        )

    def _leave(self, leaving: DriveState) -> bool:
        """Brake, then make transition 5 or 8."""
        stands = self._stopping.by(_RAMPS[leaving])
        if stands:
            self.enter(leaving)
        return stands

    def _quick_stop(self) -> bool:
        stands = self._stopping.quick_stop()
        if stands and not self._stopping.stays:
            self.enter(DriveState.SWITCH_ON_DISABLED)
        return stands

    def _slow_down(self) -> bool:
        stands = self._severe or self._stopping.by(indices.FAULT_REACTION_OPTION)
        if stands:
            self.enter(DriveState.FAULT)
        return stands


# Supervision of a drive: its supply, its motor and the following error.

_OPEN_PHASE_SHARE: Final = 0.05
"""Share of the current limit below which no current counts as flowing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds(Immutable):
    """Limits within which a drive reports no fault.

    Attributes:
        supply_mv: lowest and highest supply voltage, in mV.
        winding_dc: highest temperature of the winding, in 0.1 degC.
        winding_warning_dc: temperature of the winding from which the drive warns, in
            0.1 degC.
        stall_us: time in us after which a motor that does not turn is a fault. The time counts
            while a motion is demanded, or while the current of the motor is limited.
    """

    supply_mv: tuple[int, int] = (9_000, 36_000)
    winding_dc: int = 1_250
    winding_warning_dc: int = 1_125
    stall_us: int = 1_000_000


class Supervision(Part):
    """Detects faults of a drive in each tick, such as under-voltage or a stalled motor.

    Args:
        axis: axis whose motor is supervised.
        bounds: limits within which the drive reports no fault.

    Attributes:
        wired: faults that physical inputs cause directly, such as a short circuit or an unplugged
            encoder.
        has_supply: whether the supply voltage is high enough (bit 4 of the statusword).
        waiting: whether a time-out is running, after which a fault would be reported.
        not_following: whether the following error is larger than its window, the object 6065h.
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
        """Return the faults whose cause is present in this tick, apart from faults of the motion.

        A short circuit is detected only while the motor is powered.
        """
        motor, bounds = self._axis.motor, self.bounds
        supply_mv = motor.supply_mv
        lowest_mv, highest_mv = bounds.supply_mv
        found = [code for code in self.wired if powered or code is not ErrorCode.OVER_CURRENT]
        if supply_mv < lowest_mv:
            found.append(ErrorCode.UNDER_VOLTAGE)
        if supply_mv > highest_mv:
            found.append(ErrorCode.OVER_VOLTAGE)
        if motor.winding_dc > bounds.winding_dc:
            found.append(ErrorCode.DRIVE_TEMPERATURE)
        return found

    def step(self, now_us: int, *, powered: bool) -> list[ErrorCode]:
        """Check the drive for faults in one tick.

        Returns:
            The error codes of the present faults. A following error and a stalled motor are
            detected only while the motor is powered.
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
        """Continue as if the motor had followed in all ticks up to `now_us`."""
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
        """Return whether the motor has stood for too long although motion is demanded."""
        axis = self._axis
        shall_turn = axis.motor.current_limited or axis.is_fast(axis.reference.velocity)
        if axis.control is Control.CURRENT or not (shall_turn and axis.stands):
            self._stall_us = now_us
            return False
        self.waiting = True
        return now_us - self._stall_us >= self.bounds.stall_us

    def _stall_code(self) -> ErrorCode:
        motor = self._axis.motor
        flows = abs(motor.current_ma) > 1_000 * _OPEN_PHASE_SHARE * motor.current_limit_a
        return ErrorCode.MOTOR_BLOCKED if flows else ErrorCode.MOTOR_PHASE
