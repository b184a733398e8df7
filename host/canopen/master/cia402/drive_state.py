"""The controlwords that bring a drive from state to state (CiA 402-2).

>>> f"{lead(0x0100, DriveState.SWITCH_ON_DISABLED, DriveState.READY_TO_SWITCH_ON):04X}h"
'0106h'
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from tickrig.host.text.names import near
from tickrig.wire.canopen.drive import Controlword, DriveState

MODE_BITS: Final = 0x0270
"""The bits that belong to the mode of operation."""


def state_named(state: DriveState | str) -> DriveState:
    """Return a drive state by its name in CiA 402, such as `Switched on`.

    Raises:
        ValueError: there is no state with this name.
    """
    by_words = {each.words: each for each in DriveState}
    if isinstance(state, DriveState):
        return state
    if state not in by_words:
        raise ValueError(f"no state {state!r}; {near(state, by_words)}")
    return by_words[state]


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
"""Bits to set, and bits to clear. All other bits keep their value."""

_ALONE: Final = (_NOTHING, _NOTHING)
"""Marks of a transition that the drive makes by itself."""

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

_ENABLING: Final[Mapping[DriveState | None, DriveState]] = {
    DriveState.FAULT_REACTION_ACTIVE: DriveState.FAULT,
    DriveState.FAULT: DriveState.SWITCH_ON_DISABLED,
    DriveState.NOT_READY_TO_SWITCH_ON: DriveState.SWITCH_ON_DISABLED,
    DriveState.SWITCH_ON_DISABLED: DriveState.READY_TO_SWITCH_ON,
    DriveState.READY_TO_SWITCH_ON: DriveState.SWITCHED_ON,
    DriveState.SWITCHED_ON: DriveState.OPERATION_ENABLED,
    DriveState.QUICK_STOP_ACTIVE: DriveState.OPERATION_ENABLED,
}
"""The next state on the way to Operation enabled."""


def next_state(state: DriveState | None, goal: DriveState) -> DriveState:
    """Return the state to which a drive must switch next.

    Args:
        state: present state of the drive, or None if it is unknown.
        goal: state that the drive is to reach in the end. For Operation enabled, the result is the
            next state on the way. For every other goal, the result is the goal.
    """
    return _ENABLING.get(state, goal) if goal is DriveState.OPERATION_ENABLED else goal


def lead(controlword: int, state: DriveState | None, following: DriveState) -> int | None:
    """Return the controlword that switches a drive from one state to the following one.

    The result is None if CiA 402 has no such transition.
    """
    bits = None if state is None else TRANSITIONS.get((state, following))
    return None if bits is None else controlword & ~int(bits[1]) | int(bits[0])
