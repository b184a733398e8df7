"""Network management: commands, states, heartbeat, and the COB-IDs of a node-ID."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from typing import Final

# COB-ID entries of the dictionary: a CAN-ID with flag bits, and the restricted CAN-IDs.

INVALID: Final = 1 << 31
"""Bit 31 of a COB-ID: the object does not exist or is not valid (PDO, EMCY, SDO, but not SYNC,
TIME)."""

FLAG_30: Final = 1 << 30
"""Bit 30 of a COB-ID: no RTR (TPDO), or the device produces the message (SYNC, TIME)."""

EXTENDED: Final = 1 << 29
"""Bit 29 of a COB-ID: 29-bit CAN-ID."""

CAN_ID_MASK: Final = 0x7FF

_RESTRICTED: Final = (
    range(0x001),
    range(0x001, 0x080),
    range(0x101, 0x181),
    range(0x581, 0x600),
    range(0x601, 0x680),
    range(0x6E0, 0x700),
    range(0x701, 0x780),
    range(0x780, 0x800),
)
"""CAN-IDs that no configurable object may use (CiA 301, table of restricted CAN-IDs)."""


def is_restricted(can_id: int) -> bool:
    """Return whether a configurable communication object must not use a CAN-ID.

    >>> is_restricted(0x601), is_restricted(0x6A0), is_restricted(0x185)
    (True, False, False)
    """
    return any(can_id in taken for taken in _RESTRICTED)


# NMT on the wire: states and commands (CiA 301, network management).

NMT_COB_ID: Final = 0x000
ERROR_CONTROL_COB_ID: Final = 0x700
"""CAN-ID of boot-up, heartbeat and guarding, without the node-ID that is added."""

ALL_NODES: Final = 0


class NmtState(IntEnum):
    """NMT state as in a heartbeat."""

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


COMMANDED: Final[Mapping[int, NmtState]] = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
}
"""Next state by command, for each state except Initialising."""

RESETS: Final = frozenset([NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION])
"""Commands after which a node boots again."""
