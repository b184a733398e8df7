"""COB-ID entries of the dictionary: a CAN-ID with flag bits, and the CAN-IDs that are taken."""

from __future__ import annotations

from typing import Final

INVALID: Final = 1 << 31
"""Bit 31: the object does not exist or is not valid (PDO, EMCY, SDO); SYNC and TIME differ."""

FLAG_30: Final = 1 << 30
"""Bit 30: no RTR (TPDO), produces (SYNC, TIME)."""

EXTENDED: Final = 1 << 29
"""Bit 29: 29-bit CAN-ID."""

CAN_ID_MASK: Final = 0x7FF

RESTRICTED: Final = (
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
    return any(can_id in taken for taken in RESTRICTED)
