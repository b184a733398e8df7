"""The statusword (CiA 402-2, 6041h)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.ds402.state.state import DriveState, Statusword

if TYPE_CHECKING:
    from tickrig.device.canopen.ds402.drive import Ds402

STATE_BITS: Final = {state: int(state | Statusword.REMOTE) for state in DriveState}
"""What it shows of a state, and that the bus is in control."""

_VOLTAGE_ENABLED: Final = int(Statusword.VOLTAGE_ENABLED)
_WARNING: Final = int(Statusword.WARNING)
_INTERNAL_LIMIT: Final = int(Statusword.INTERNAL_LIMIT)
_FOLLOWING_ERROR: Final = int(Statusword.MODE_13)


def statusword_of(drive: Ds402) -> int:
    """Return what 6041h of a drive shows now."""
    supervision, state = drive.supervision, drive.automaton.state
    status = STATE_BITS[state]
    if supervision.has_supply:
        status |= _VOLTAGE_ENABLED
    if supervision.warns:
        status |= _WARNING
    if drive.limited:
        status |= _INTERNAL_LIMIT
    if state is DriveState.OPERATION_ENABLED:
        status |= int(drive.mode.flags)
        if supervision.not_following and drive.mode.tells_following_error:
            status |= _FOLLOWING_ERROR
    return status
