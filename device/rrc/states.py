"""States and transitions of the RRC (RRC manual, state diagram and its conditions 1 to 9)."""

from __future__ import annotations

from enum import Enum, auto
from typing import Final


class RrcState(Enum):
    """The states of the diagram, S0 to S8."""

    OFF = "Off"
    INITIALIZE = "Initialize"
    WAIT_POWER_ON = "WaitPowerOn"
    STANDBY = "Standby"
    LIMIT = "Limit"
    OUTPUT = "Output"
    POWER_OFF_BY_BUTTON = "PowerOffByButton"
    POWER_OFF_BY_OTHERS = "PowerOffByOthers"
    POWER_OFF_FINISHED = "PowerOffFinished"


class Move(Enum):
    """What makes the RRC change its state."""

    INITIALIZED = auto()
    POWER_ON_FAILED = auto()
    POWER_ON_SUCCEEDED = auto()
    LIMIT = auto()
    OUTPUT = auto()
    POWER_BUTTON = auto()
    FORCED = auto()
    TRAFFIC_ENDED = auto()
    RESTART = auto()


POWERED_ON: Final = (RrcState.STANDBY, RrcState.LIMIT, RrcState.OUTPUT)
"""The "PowerOnSuccess period" of the manual: VR2 runs."""

NEXT_STATE: Final[dict[tuple[RrcState, Move], RrcState]] = {
    (RrcState.INITIALIZE, Move.INITIALIZED): RrcState.WAIT_POWER_ON,  # 2
    # 3 stays in WAIT_POWER_ON, or starts again (DECISION R3)
    (RrcState.WAIT_POWER_ON, Move.POWER_ON_FAILED): RrcState.INITIALIZE,
    (RrcState.WAIT_POWER_ON, Move.POWER_ON_SUCCEEDED): RrcState.STANDBY,  # 4
    **{(state, Move.LIMIT): RrcState.LIMIT for state in POWERED_ON},  # 5 (DECISION R4)
    **{(state, Move.OUTPUT): RrcState.OUTPUT for state in POWERED_ON},  # 6 (DECISION R4)
    **{(state, Move.POWER_BUTTON): RrcState.POWER_OFF_BY_BUTTON for state in POWERED_ON},  # 7
    **{(state, Move.FORCED): RrcState.POWER_OFF_BY_OTHERS for state in POWERED_ON},  # 8
    (RrcState.POWER_OFF_BY_BUTTON, Move.TRAFFIC_ENDED): RrcState.POWER_OFF_FINISHED,  # 9
    (RrcState.POWER_OFF_BY_OTHERS, Move.TRAFFIC_ENDED): RrcState.POWER_OFF_FINISHED,  # 9
    (RrcState.POWER_OFF_FINISHED, Move.RESTART): RrcState.INITIALIZE,  # "at once"
}
