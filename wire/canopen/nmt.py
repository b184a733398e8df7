"""NMT on the wire: states and commands (CiA 301, network management)."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

NMT_COB_ID: Final = 0x000
ERROR_CONTROL_COB_ID: Final = 0x700
"""Boot-up, heartbeat and guarding of node n are on this plus n."""

ALL_NODES: Final = 0


class NmtState(IntEnum):
    """NMT state as a heartbeat carries it."""

    INITIALISING = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


class NmtCommand(IntEnum):
    """NMT command specifier."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82
