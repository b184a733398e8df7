"""States of a drive by its statusword, and the controlwords that lead on (CiA 402-2).

>>> state_of(0x0637)
<DriveState.OPERATION_ENABLED: 'Operation enabled'>
>>> f"{lead(0x0100, DriveState.SWITCH_ON_DISABLED, DriveState.READY_TO_SWITCH_ON):04X}h"
'0106h'
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, IntEnum, IntFlag
from typing import Final

from tickrig.host.canopen.dialogue import Script
from tickrig.host.text.names import near


class Controlword(IntFlag):
    """Bits of 6040h."""

    SWITCH_ON = 0x0001
    ENABLE_VOLTAGE = 0x0002
    QUICK_STOP = 0x0004  # active at 0
    ENABLE_OPERATION = 0x0008
    MODE_4 = 0x0010
    MODE_5 = 0x0020
    MODE_6 = 0x0040
    FAULT_RESET = 0x0080
    HALT = 0x0100
    MODE_9 = 0x0200


MODE_BITS: Final = 0x0270
"""The bits that belong to the mode of operation."""


class Statusword(IntFlag):
    """Bits of 6041h that a mode of operation looks at."""

    TARGET_REACHED = 0x0400
    MODE_12 = 0x1000
    MODE_13 = 0x2000


class DriveState(Enum):
    """State of a drive, in words."""

    UNKNOWN = "unknown"
    NOT_READY_TO_SWITCH_ON = "Not ready to switch on"
    SWITCH_ON_DISABLED = "Switch on disabled"
    READY_TO_SWITCH_ON = "Ready to switch on"
    SWITCHED_ON = "Switched on"
    OPERATION_ENABLED = "Operation enabled"
    QUICK_STOP_ACTIVE = "Quick stop active"
    FAULT_REACTION_ACTIVE = "Fault reaction active"
    FAULT = "Fault"

    @classmethod
    def of(cls, state: DriveState | str) -> DriveState:
        """Return a state by its words, as `Switched on`; ValueError if there is none."""
        try:
            return cls(state)
        except ValueError:
            names = [each.value for each in cls]
            raise ValueError(f"no state {state!r}; {near(str(state), names)}") from None


_PATTERNS: Final = (
    (0x4F, 0x00, DriveState.NOT_READY_TO_SWITCH_ON),
    (0x4F, 0x40, DriveState.SWITCH_ON_DISABLED),
    (0x6F, 0x21, DriveState.READY_TO_SWITCH_ON),
    (0x6F, 0x23, DriveState.SWITCHED_ON),
    (0x6F, 0x27, DriveState.OPERATION_ENABLED),
    (0x6F, 0x07, DriveState.QUICK_STOP_ACTIVE),
    (0x4F, 0x0F, DriveState.FAULT_REACTION_ACTIVE),
    (0x4F, 0x08, DriveState.FAULT),
)
"""Mask, value, state."""

_ON: Final = Controlword.SWITCH_ON
_VOLTAGE: Final = Controlword.ENABLE_VOLTAGE
_NO_STOP: Final = Controlword.QUICK_STOP
_ENABLE: Final = Controlword.ENABLE_OPERATION
_RESET: Final = Controlword.FAULT_RESET
_NOTHING: Final = Controlword(0)

_DISABLE_VOLTAGE: Final = (_NOTHING, _RESET | _VOLTAGE)
_SHUTDOWN: Final = (_NO_STOP | _VOLTAGE, _RESET | _ON)
_SWITCH_ON: Final = (_NO_STOP | _VOLTAGE | _ON, _RESET | _ENABLE)
_ENABLE_OPERATION: Final = (_NO_STOP | _VOLTAGE | _ON | _ENABLE, _RESET)
_QUICK_STOP: Final = (_VOLTAGE, _RESET | _NO_STOP)
"""Bits that are set, and bits that are cleared; all others stay."""

_ALONE: Final = (_NOTHING, _NOTHING)
"""The drive makes this transition by itself."""

TRANSITIONS: Final = {
    (DriveState.NOT_READY_TO_SWITCH_ON, DriveState.SWITCH_ON_DISABLED): _ALONE,  # transition 1
    (DriveState.SWITCH_ON_DISABLED, DriveState.READY_TO_SWITCH_ON): _SHUTDOWN,  # 2
    (DriveState.READY_TO_SWITCH_ON, DriveState.SWITCHED_ON): _SWITCH_ON,  # 3
    (DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED): _ENABLE_OPERATION,  # 4
    (DriveState.OPERATION_ENABLED, DriveState.SWITCHED_ON): _SWITCH_ON,  # 5
    (DriveState.SWITCHED_ON, DriveState.READY_TO_SWITCH_ON): _SHUTDOWN,  # 6
    (DriveState.READY_TO_SWITCH_ON, DriveState.SWITCH_ON_DISABLED): _DISABLE_VOLTAGE,  # 7
    (DriveState.OPERATION_ENABLED, DriveState.READY_TO_SWITCH_ON): _SHUTDOWN,  # 8
    (DriveState.OPERATION_ENABLED, DriveState.SWITCH_ON_DISABLED): _DISABLE_VOLTAGE,  # 9
    (DriveState.SWITCHED_ON, DriveState.SWITCH_ON_DISABLED): _DISABLE_VOLTAGE,  # 10
    (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE): _QUICK_STOP,  # 11
    (DriveState.QUICK_STOP_ACTIVE, DriveState.SWITCH_ON_DISABLED): _DISABLE_VOLTAGE,  # 12
    (DriveState.FAULT_REACTION_ACTIVE, DriveState.FAULT): _ALONE,  # 14
    (DriveState.FAULT, DriveState.SWITCH_ON_DISABLED): (_RESET, _NOTHING),  # 15
    (DriveState.QUICK_STOP_ACTIVE, DriveState.OPERATION_ENABLED): _ENABLE_OPERATION,  # 16
}

_ENABLING: Final = {
    DriveState.FAULT_REACTION_ACTIVE: DriveState.FAULT,
    DriveState.FAULT: DriveState.SWITCH_ON_DISABLED,
    DriveState.NOT_READY_TO_SWITCH_ON: DriveState.SWITCH_ON_DISABLED,
    DriveState.SWITCH_ON_DISABLED: DriveState.READY_TO_SWITCH_ON,
    DriveState.READY_TO_SWITCH_ON: DriveState.SWITCHED_ON,
    DriveState.SWITCHED_ON: DriveState.OPERATION_ENABLED,
    DriveState.QUICK_STOP_ACTIVE: DriveState.OPERATION_ENABLED,
}
"""The next state on the way to Operation enabled."""


def state_of(statusword: int) -> DriveState:
    """Return the state that a statusword says."""
    for mask, value, state in _PATTERNS:
        if statusword & mask == value:
            return state
    return DriveState.UNKNOWN


def next_state(state: DriveState, goal: DriveState) -> DriveState:
    """Return the next state on the way to another: it itself, unless that is Operation enabled."""
    return _ENABLING.get(state, goal) if goal is DriveState.OPERATION_ENABLED else goal


def lead(controlword: int, state: DriveState, following: DriveState) -> int | None:
    """Return the controlword that leads from a state to another, None if none does."""
    bits = TRANSITIONS.get((state, following))
    return None if bits is None else controlword & ~int(bits[1]) | int(bits[0])


# Modes of operation, each with its set-point and its handshake (CiA 402-2).

_START: Final = Controlword.MODE_4
"""New set-point, start homing, interpolate."""

_AT_ONCE: Final = Controlword.MODE_5


class ModeNumber(IntEnum):
    """Modes of operation, 6060h."""

    NONE = 0
    PROFILE_POSITION = 1
    VELOCITY = 2
    PROFILE_VELOCITY = 3
    PROFILE_TORQUE = 4
    HOMING = 6
    INTERPOLATED_POSITION = 7
    CYCLIC_POSITION = 8
    CYCLIC_VELOCITY = 9
    CYCLIC_TORQUE = 10

    @classmethod
    def of(cls, mode: int | str) -> ModeNumber:
        """Return a mode by its usual abbreviation, as `pp`; ValueError if there is none."""
        if isinstance(mode, int) and mode in list(cls):
            return cls(mode)
        mode = str(mode)
        if mode not in _SHORT:
            raise ValueError(f"no mode {mode!r}; {near(mode, _SHORT)}")
        return _SHORT[mode]


_SHORT: Final[Mapping[str, ModeNumber]] = {
    "none": ModeNumber.NONE,
    "pp": ModeNumber.PROFILE_POSITION,
    "vl": ModeNumber.VELOCITY,
    "pv": ModeNumber.PROFILE_VELOCITY,
    "tq": ModeNumber.PROFILE_TORQUE,
    "hm": ModeNumber.HOMING,
    "ip": ModeNumber.INTERPOLATED_POSITION,
    "csp": ModeNumber.CYCLIC_POSITION,
    "csv": ModeNumber.CYCLIC_VELOCITY,
    "cst": ModeNumber.CYCLIC_TORQUE,
}


@dataclass(frozen=True, slots=True)
class DriveObject:
    """An object of a drive.

    Attributes:
        index: of its first axis.
        size: bytes.
        sub: of the object.
        signed: whether it is an INTEGER.
    """

    index: int
    size: int
    sub: int = 0
    signed: bool = True

    @property
    def lowest(self) -> int:
        """The least value."""
        return -(1 << 8 * self.size - 1) if self.signed else 0

    @property
    def highest(self) -> int:
        """The greatest value."""
        return (1 << 8 * self.size - self.signed) - 1

    def value_of(self, bits: int) -> int:
        """Return the value that so many bits are."""
        return bits - (1 << 8 * self.size) if bits > self.highest else bits

    def bits_of(self, value: int) -> int:
        """Return the bits of a value."""
        return value & (1 << 8 * self.size) - 1


_Write = Callable[[DriveObject, int], Script[None]]


class DriveMode:
    """What a mode does in each period; it is chosen while the drive has it.

    Attributes:
        controlword: its bits of 6040h.
    """

    def __init__(self) -> None:
        self.controlword = 0

    def begin(self) -> None:
        """Have no set-point, as when the mode is chosen."""

    def set_target(self, value: float) -> None:
        """Take a set-point in units of the device; ValueError where a mode has none."""
        raise ValueError("this mode has no target")

    def read(self, statusword: int) -> None:
        """Take the statusword of this period."""

    def write(self, write: _Write) -> Script[bool]:
        """Write the set-point; return whether there is one: without, the drive is halted."""
        yield from ()
        return False


class TargetMode(DriveMode):
    """Writes its target in each period.

    Args:
        target: the object.
        bits: of the controlword, set while there is a target.
    """

    def __init__(self, target: DriveObject, bits: int = 0) -> None:
        super().__init__()
        self._object, self._bits = target, bits
        self._target: int | None = None

    def begin(self) -> None:
        """Have no target."""
        self._target = None

    def set_target(self, value: float) -> None:
        """Take a target; what is too large for the object is cut.

        Raises:
            ValueError: it is no number.
        """
        if not math.isfinite(value):
            raise ValueError(f"{value} is no target")
        self._target = max(self._object.lowest, min(int(value), self._object.highest))

    def write(self, write: _Write) -> Script[bool]:
        """Write the target, if there is one."""
        if self._target is None:
            self.controlword &= ~self._bits
            return False
        self.controlword |= self._bits
        yield from write(self._object, self._target)
        return True


class _ProfilePositionMode(TargetMode):
    """Writes each new target once, and has it taken by the handshake of bits 4 and 12."""

    def begin(self) -> None:
        """Have no target, and none that was given."""
        super().begin()
        self._given: int | None = None
        self._acknowledged = False

    def read(self, statusword: int) -> None:
        """Look for the acknowledge."""
        self._acknowledged = bool(statusword & Statusword.MODE_12)

    def write(self, write: _Write) -> Script[bool]:
        """Raise bit 4 for a new target, let it fall when it is acknowledged."""
        self.controlword |= _AT_ONCE
        if self._target is None:
            return False
        if self._acknowledged:
            self.controlword &= ~_START
        elif self._target != self._given:
            if self.controlword & _START:
                self.controlword &= ~_START
            else:
                yield from write(self._object, self._target)
                self.controlword |= _START
                self._given = self._target
        return True


class HomingMode(DriveMode):
    """Starts homing by bit 4; bits 10, 12 and 13 of the statusword say how it goes.

    Attributes:
        runs: homing is to run.
        status: these bits.
    """

    MASK: Final = Statusword.TARGET_REACHED | Statusword.MODE_12 | Statusword.MODE_13

    def begin(self) -> None:
        """Do not home."""
        self.runs, self.status = False, 0

    def read(self, statusword: int) -> None:
        """Take its bits."""
        self.status = statusword & self.MASK

    def write(self, write: _Write) -> Script[bool]:
        """Set bit 4 while homing is to run."""
        self.controlword = int(_START) if self.runs else 0
        yield from ()
        return self.runs


_POSITION: Final = DriveObject(0x607A, 4)
_SPEED: Final = DriveObject(0x60FF, 4)
_TORQUE: Final = DriveObject(0x6071, 2)
_FREQUENCY: Final = DriveObject(0x6042, 2)
_INTERPOLATED: Final = DriveObject(0x60C1, 4, sub=1)

TARGETS: Final = (_POSITION, _SPEED, _TORQUE, _FREQUENCY, _INTERPOLATED)
"""The set-points of all modes."""

MODES: Final[Mapping[ModeNumber, Callable[[], DriveMode]]] = {
    ModeNumber.PROFILE_POSITION: lambda: _ProfilePositionMode(_POSITION),
    ModeNumber.VELOCITY: lambda: TargetMode(_FREQUENCY, 0x70),
    ModeNumber.PROFILE_VELOCITY: lambda: TargetMode(_SPEED),
    ModeNumber.PROFILE_TORQUE: lambda: TargetMode(_TORQUE),
    ModeNumber.HOMING: HomingMode,
    ModeNumber.INTERPOLATED_POSITION: lambda: TargetMode(_INTERPOLATED, _START),
    ModeNumber.CYCLIC_POSITION: lambda: TargetMode(_POSITION),
    ModeNumber.CYCLIC_VELOCITY: lambda: TargetMode(_SPEED),
    ModeNumber.CYCLIC_TORQUE: lambda: TargetMode(_TORQUE),
}

POSITIONS: Final = (
    ModeNumber.PROFILE_POSITION,
    ModeNumber.INTERPOLATED_POSITION,
    ModeNumber.CYCLIC_POSITION,
)
SPEEDS: Final = (ModeNumber.VELOCITY, ModeNumber.PROFILE_VELOCITY, ModeNumber.CYCLIC_VELOCITY)
"""Modes whose targets are scaled; torques go to the device as they are."""
