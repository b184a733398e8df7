"""A drive (CiA 402-2)."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

from tickrig.device.canopen.abort import SdoAbort
from tickrig.device.canopen.application import Application, number_of
from tickrig.device.canopen.ds402_axis import Axis
from tickrig.device.canopen.ds402_modes import MODES, Mode
from tickrig.device.canopen.ds402_state import (
    NEXT_STATE,
    Controlword,
    DriveState,
    Statusword,
    command_of,
)
from tickrig.device.canopen.slave import TICK_US, CanopenSlave
from tickrig.wire.canopen.abort import AbortCode
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.emcy import ErrorRegister
from tickrig.wire.canopen.nmt import NmtState

ABORT_CONNECTION: Final = 0x6007
ERROR_CODE: Final = 0x603F
CONTROLWORD: Final = 0x6040
STATUSWORD: Final = 0x6041
QUICK_STOP_OPTION: Final = 0x605A
MODES_OF_OPERATION: Final = 0x6060
MODES_OF_OPERATION_DISPLAY: Final = 0x6061
POSITION_ACTUAL_VALUE: Final = 0x6064
VELOCITY_ACTUAL_VALUE: Final = 0x606C
TARGET_POSITION: Final = 0x607A
HOME_OFFSET: Final = 0x607C
PROFILE_VELOCITY: Final = 0x6081
PROFILE_ACCELERATION: Final = 0x6083
PROFILE_DECELERATION: Final = 0x6084
QUICK_STOP_DECELERATION: Final = 0x6085
HOMING_METHOD: Final = 0x6098
TARGET_VELOCITY: Final = 0x60FF

DEFAULTS: Final = {
    QUICK_STOP_OPTION: 2,
    ABORT_CONNECTION: 1,
    PROFILE_VELOCITY: 10_000,
    PROFILE_ACCELERATION: 10_000,
    PROFILE_DECELERATION: 10_000,
    QUICK_STOP_DECELERATION: 100_000,
}
"""Increments per second (squared), where the device has no such object."""

DISABLE: Final = 0
"""Quick stop option: no ramp."""

STAYING: Final = range(5, 9)
"""Quick stop options that stay in Quick stop active."""

POWERED: Final = (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE)

_REGISTERS: Final = {
    0x2: ErrorRegister.CURRENT,
    0x3: ErrorRegister.VOLTAGE,
    0x4: ErrorRegister.TEMPERATURE,
    0x8: ErrorRegister.COMMUNICATION,
}
"""Bit of the error register by the first digit of the error code."""


class AbortConnection(IntEnum):
    """What a lost connection does (6007h)."""

    NO_ACTION = 0
    FAULT = 1
    DISABLE_VOLTAGE = 2
    QUICK_STOP = 3


class Ds402(Application):
    """A drive of one axis with an ideal motor.

    The controlword acts when it changes; from Ready to switch on, Enable operation
    leads through Switched on at once. Quick stop ramps down, then stays or goes to
    Switch on disabled as 605Ah says. A fault stops the motor at once and is reset
    by a rising edge of bit 7. A lost connection and NMT Stop act as 6007h says
    while the motor has power. Modes: profile position 1, profile velocity 3,
    homing 6 with methods 35 and 37, cyclic synchronous position 8 and velocity 9;
    another one is refused with 0609 0030h.

    Not emulated: torque, limits, units and factors, the options of shutdown,
    disable operation, halt and fault reaction, a brake.

    Attributes:
        axis: the motor.
        state: of the drive.
        controlword: as it was written last.
        mode: the mode of operation at work.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        find = node.dictionary.find
        self.axis, self.state = Axis(), DriveState.NOT_READY_TO_SWITCH_ON
        self.controlword, self._codes = 0, list[int]()
        self.mode: Mode = Mode(self)
        control, mode = find(CONTROLWORD), find(MODES_OF_OPERATION)
        if control is not None:
            control.watchers.append(self._controlled)
        if mode is not None:
            mode.guard = _known_mode
            mode.watchers.append(self._change_mode)
        targets = (find(TARGET_POSITION), find(TARGET_VELOCITY))
        self.watch(entry for entry in targets if entry is not None)

    @property
    def target_position(self) -> int:
        """Increments."""
        return self._number(TARGET_POSITION)

    @property
    def target_velocity(self) -> int:
        """Increments per second."""
        return self._number(TARGET_VELOCITY)

    @property
    def profile_velocity(self) -> int:
        """Increments per second."""
        return self._number(PROFILE_VELOCITY)

    @property
    def acceleration(self) -> int:
        """Increments per second per second."""
        return max(1, self._number(PROFILE_ACCELERATION))

    @property
    def deceleration(self) -> int:
        """Increments per second per second."""
        return max(1, self._number(PROFILE_DECELERATION))

    @property
    def homing_method(self) -> int:
        """As in 6098h."""
        return self._number(HOMING_METHOD)

    @property
    def home_offset(self) -> int:
        """Increments."""
        return self._number(HOME_OFFSET)

    def fault(self, code: int) -> None:
        """Have a fault with an emergency error code."""
        self._codes.append(code)
        self._set(ERROR_CODE, code)
        self.node.emergency(code, _REGISTERS.get(code >> 12, ErrorRegister.DEVICE_PROFILE))
        self._enter_fault()

    def start(self) -> None:
        """Switch off."""
        self.state, self._codes = DriveState.NOT_READY_TO_SWITCH_ON, []
        self.controlword = self._number(CONTROLWORD)
        self.axis.halt()
        self._change_mode()

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """Take NMT Stop for a lost connection."""
        if new is NmtState.STOPPED:
            self.communication_error()

    def communication_error(self) -> None:
        """Act as 6007h says."""
        if self.state not in POWERED:
            return
        match self._number(ABORT_CONNECTION):
            case AbortConnection.FAULT:
                self._enter_fault()
            case AbortConnection.DISABLE_VOLTAGE:
                self._enter(DriveState.SWITCH_ON_DISABLED)
            case AbortConnection.QUICK_STOP:
                self._enter(DriveState.QUICK_STOP_ACTIVE)
            case _:  # no action, or what a manufacturer might mean
                return

    def on_execute(self, now_us: int) -> None:
        """Move the axis, tell state, position and velocity."""
        settled = self._run()
        self._set(STATUSWORD, self._statusword())
        self._set(POSITION_ACTUAL_VALUE, self.axis.position)
        self._set(VELOCITY_ACTUAL_VALUE, self.axis.velocity)
        if not settled:
            self.schedule(now_us + TICK_US)

    def _run(self) -> bool:
        """Do what the state does; say whether nothing is left to do."""
        match self.state:
            case DriveState.NOT_READY_TO_SWITCH_ON:
                self.state = DriveState.SWITCH_ON_DISABLED
            case DriveState.OPERATION_ENABLED:
                return self.mode.run()
            case DriveState.QUICK_STOP_ACTIVE:
                return self._quick_stop()
            case DriveState.FAULT_REACTION_ACTIVE:
                self.axis.halt()
                self.state = DriveState.FAULT
            case _:
                self.axis.halt()
        return True

    def _quick_stop(self) -> bool:
        option = self._number(QUICK_STOP_OPTION)
        if option == DISABLE:
            self.axis.halt()
        else:
            self.axis.run(0, max(1, self._number(QUICK_STOP_DECELERATION)))
        if self.axis.stands and option not in STAYING:
            self.state = DriveState.SWITCH_ON_DISABLED
        return self.axis.stands

    def _controlled(self) -> None:
        """Obey a new controlword."""
        before, self.controlword = self.controlword, self._number(CONTROLWORD)
        rising = self.controlword & ~before
        if self.state is DriveState.FAULT and rising & Controlword.FAULT_RESET:
            self._reset_fault()
        else:
            self._obey()
        if self.state is DriveState.OPERATION_ENABLED:
            if rising & Controlword.START:
                self.mode.start()
            if before & ~self.controlword & Controlword.START:
                self.mode.stop()
        self.request()

    def _obey(self) -> None:
        command = command_of(self.controlword)
        following = NEXT_STATE.get((self.state, command)) if command is not None else None
        leaves_quick_stop = (
            self.state is DriveState.QUICK_STOP_ACTIVE and following is DriveState.OPERATION_ENABLED
        )
        if leaves_quick_stop and self._number(QUICK_STOP_OPTION) not in STAYING:
            return
        if following is not None:
            self._enter(following)

    def _enter(self, state: DriveState) -> None:
        self.state = state
        if state is DriveState.OPERATION_ENABLED:
            self.mode = type(self.mode)(self)
        self.request()

    def _enter_fault(self) -> None:
        if self.state is not DriveState.FAULT:
            self._enter(DriveState.FAULT_REACTION_ACTIVE)

    def _reset_fault(self) -> None:
        for code in self._codes:
            self.node.emergency_clear(code)
        self._codes = []
        self._set(ERROR_CODE, 0)
        self._enter(DriveState.SWITCH_ON_DISABLED)

    def _change_mode(self) -> None:
        number = self._number(MODES_OF_OPERATION)
        make = MODES.get(number)
        if make is not None:
            self.mode = make(self)
            self._set(MODES_OF_OPERATION_DISPLAY, number)
        self.request()

    def _statusword(self) -> int:
        status = self.state | Statusword.VOLTAGE_ENABLED | Statusword.REMOTE
        if self.state is DriveState.OPERATION_ENABLED:
            status |= self.mode.flags
        return status

    def _number(self, index: int) -> int:
        return number_of(self.node.dictionary.find(index), DEFAULTS.get(index, 0))

    def _set(self, index: int, value: int) -> None:
        entry = self.node.dictionary.find(index)
        if entry is not None:
            entry.value = value


def _known_mode(value: Value) -> None:
    if value not in MODES:
        raise SdoAbort(AbortCode.VALUE_RANGE)
