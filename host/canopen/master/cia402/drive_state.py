"""States of a drive by its statusword, and the controlwords that lead on (CiA 402-2).

>>> state_of(0x0637)
<DriveState.OPERATION_ENABLED: 'Operation enabled'>
>>> f"{lead(0x0100, DriveState.SWITCH_ON_DISABLED, DriveState.READY_TO_SWITCH_ON):04X}h"
'0106h'
"""

from __future__ import annotations

from enum import Enum, IntFlag
from typing import Final

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
    """Bits of 6041h that depend on the mode of operation."""

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
        """Return a state by its name, as `Switched on`; ValueError if there is none."""
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
"""Bits to set, and bits to clear; all others stay."""

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
    """Return the state in a statusword."""
    for mask, value, state in _PATTERNS:
        if statusword & mask == value:
            return state
    return DriveState.UNKNOWN


def next_state(state: DriveState, goal: DriveState) -> DriveState:
    """Return the next state on the way: the state itself, except for Operation enabled."""
    return _ENABLING.get(state, goal) if goal is DriveState.OPERATION_ENABLED else goal


def lead(controlword: int, state: DriveState, following: DriveState) -> int | None:
    """Return the controlword that leads from a state to another, None if there is none."""
    bits = TRANSITIONS.get((state, following))
    return None if bits is None else controlword & ~int(bits[1]) | int(bits[0])
