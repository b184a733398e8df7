"""Controlword and statusword of a drive, and the states in a statusword (CiA 402-2).

>>> state_of(0x0637)
<DriveState.OPERATION_ENABLED: 39>
>>> state_of(0x0637).words
'Operation enabled'
"""

from __future__ import annotations

from enum import IntEnum, IntFlag
from typing import Final


class Controlword(IntFlag):
    """Bits of the controlword 6040h of a drive.

    The mode of operation defines the meaning of bits 4, 5, 6 and 9.
    """

    SWITCH_ON = 0x0001
    ENABLE_VOLTAGE = 0x0002
    QUICK_STOP = 0x0004  # active at 0
    ENABLE_OPERATION = 0x0008
    START = 0x0010  # new set-point, start homing, interpolate
    CHANGE_AT_ONCE = 0x0020
    RELATIVE = 0x0040
    FAULT_RESET = 0x0080
    HALT = 0x0100
    CHANGE_ON_SET_POINT = 0x0200


class Statusword(IntFlag):
    """Bits of the statusword 6041h of a drive, except the bits that contain its state.

    The mode of operation defines the meaning of bits 12 and 13.
    """

    VOLTAGE_ENABLED = 0x0010
    WARNING = 0x0080
    REMOTE = 0x0200
    TARGET_REACHED = 0x0400
    INTERNAL_LIMIT = 0x0800
    MODE_12 = 0x1000  # set-point acknowledge, homing attained, speed is zero, follows the target
    MODE_13 = 0x2000  # homing error, following error
    HOMED = 0x8000  # of the manufacturer: the position refers to the home position


class DriveState(IntEnum):
    """State by its bits in the statusword."""

    NOT_READY_TO_SWITCH_ON = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY_TO_SWITCH_ON = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION_ACTIVE = 0x0F
    FAULT = 0x08

    @property
    def words(self) -> str:
        """The name in the spelling of the standard, such as `Ready to switch on`."""
        return self.name.capitalize().replace("_", " ")


_ANY_QUICK_STOP: Final = (
    *(DriveState.NOT_READY_TO_SWITCH_ON, DriveState.SWITCH_ON_DISABLED),
    *(DriveState.FAULT_REACTION_ACTIVE, DriveState.FAULT),
)
"""States in which bit 5 (quick stop) of the statusword does not count."""


def state_of(statusword: int) -> DriveState | None:
    """Return the state of the drive that a statusword contains, or None if the state is invalid."""
    for state in DriveState:
        if statusword & (0x4F if state in _ANY_QUICK_STOP else 0x6F) == state:
            return state
    return None
