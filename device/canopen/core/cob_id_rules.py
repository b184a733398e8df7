"""What may be written to the COB-ID of a service that is not a PDO."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.entry import Entry
from tickrig.wire.canopen.cob_id import CAN_ID_MASK, FLAG_30, INVALID, is_restricted
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.sdo.abort import AbortCode

InUse = Callable[[int], bool]


def is_valid(cob_id: int) -> bool:
    """Say whether the object exists: bit 31 is 0 (EMCY)."""
    return not cob_id & INVALID


def takes_part(cob_id: int) -> bool:
    """Say whether the device consumes or produces: bit 31 or bit 30 is 1 (TIME)."""
    return bool(cob_id & (INVALID | FLAG_30))


def cob_id_guard(entry: Entry, flags: int, in_use: InUse) -> Callable[[Value], None]:
    """Return a guard for a COB-ID.

    It refuses with 0609 0030h: bits that are neither flags nor an 11-bit CAN-ID
    (29-bit CAN-IDs are not emulated), a restricted CAN-ID in use, and another
    CAN-ID while the old one is in use and stays so.

    Args:
        entry: the COB-ID.
        flags: the bits that have a meaning beside the CAN-ID.
        in_use: says whether the service uses its CAN-ID.
    """
    unknown: Final = ~(flags | CAN_ID_MASK)

    def guard(value: Value) -> None:
        cob_id, old = value if isinstance(value, int) else unknown, entry.number
        can_id = cob_id & CAN_ID_MASK
        refused = in_use(cob_id) and (
            is_restricted(can_id) or (in_use(old) and can_id != old & CAN_ID_MASK)
        )
        if cob_id & unknown or refused:
            raise SdoAbort(AbortCode.VALUE_RANGE)

    return guard
