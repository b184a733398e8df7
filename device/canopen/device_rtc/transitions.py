"""States of a DeviceRTC and what runs on the way (NEDO report, 3.4.43.3, Table 3, Fig. 110).

Where figure and table are silent the decisions K6 to K13 of the project hold.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Final

from tickrig.wire.canopen.nmt import NmtCommand, NmtState


class RtcState(Enum):
    """State of a component (OMG RTC 1.1, LifeCycleState), and what comes after the end."""

    CREATED = "Created"
    INACTIVE = "Inactive"
    ACTIVE = "Active"
    ERROR = "Error"
    FINALIZED = "Finalized"


STATES: Final = {
    NmtState.INITIALISING: RtcState.CREATED,
    NmtState.PRE_OPERATIONAL: RtcState.INACTIVE,
    NmtState.OPERATIONAL: RtcState.ACTIVE,
    NmtState.STOPPED: RtcState.ERROR,
}
"""Table 3, for a component that was initialized."""

ACTIVITIES: Final = {
    RtcState.INACTIVE: "error_check",
    RtcState.ACTIVE: "on_execute",
    RtcState.ERROR: "on_error",
}
"""What a state does at the rate of the component."""

Effects = Mapping[NmtCommand, tuple[str, ...]]

MOVES: Final[Effects] = {
    NmtCommand.START: (),
    NmtCommand.STOP: (),
    NmtCommand.ENTER_PRE_OPERATIONAL: (),
}
RESETS: Final[Effects] = {
    NmtCommand.RESET_NODE: ("on_reset",),
    NmtCommand.RESET_COMMUNICATION: ("on_reset",),
}
ADMITTED: Final[Mapping[RtcState, Effects]] = {
    RtcState.CREATED: {NmtCommand.RESET_NODE: ()},  # K11
    RtcState.INACTIVE: {
        **MOVES,
        NmtCommand.RESET_NODE: ("on_finalize",),
        NmtCommand.RESET_COMMUNICATION: (),
    },
    RtcState.ACTIVE: {
        **MOVES,
        NmtCommand.RESET_NODE: ("on_deactivated", "on_finalize"),
        NmtCommand.RESET_COMMUNICATION: ("on_deactivated",),
    },
    RtcState.ERROR: RESETS,  # K8, K9
    RtcState.FINALIZED: {},
}
"""Commands that are carried out, and what runs before (M8, M9, K10)."""

STRICT_ERROR: Final[Effects] = {
    **RESETS,
    NmtCommand.START: ("on_reset",),
    NmtCommand.ENTER_PRE_OPERATIONAL: ("on_reset",),
}
"""The same in Error with `strict_cia301` (K9)."""

ENTERED: Final[Mapping[tuple[NmtState, NmtState], tuple[str, ...]]] = {
    (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL): ("on_activated",),  # M2
    (NmtState.STOPPED, NmtState.OPERATIONAL): ("on_activated",),  # K9
    (NmtState.OPERATIONAL, NmtState.PRE_OPERATIONAL): ("on_deactivated",),  # M3
    (NmtState.OPERATIONAL, NmtState.STOPPED): ("on_deactivated", "on_aborting"),  # M6, M7, K6
}
"""What runs after a change of the NMT state; nothing on M4 and M5 (K7)."""

ENDING: Final = {
    RtcState.INACTIVE: ("on_finalize",),
    RtcState.ACTIVE: ("on_deactivated", "on_finalize"),
    RtcState.ERROR: ("on_finalize",),
}
"""What runs before the end (M11)."""
