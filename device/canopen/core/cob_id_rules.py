"""What may be written to the COB-ID of a service that is not a PDO."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.entry import Entry
from tickrig.wire.canopen.cob_id import CAN_ID_MASK, FLAG_30, INVALID, is_restricted
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.sdo.abort import AbortCode

_NOT_SDO: Final = ~(INVALID | FLAG_30 | CAN_ID_MASK)
_NOT_EMCY: Final = ~(INVALID | CAN_ID_MASK)


def is_valid(cob_id: int) -> bool:
    """Return whether the object exists: bit 31 is 0 (EMCY, SDO)."""
    return not cob_id & INVALID


def takes_part(cob_id: int) -> bool:
    """Return whether the device consumes or produces: bit 31 or bit 30 is 1 (TIME)."""
    return bool(cob_id & (INVALID | FLAG_30))


def check_emcy_cob_id(entry: Entry, value: Value) -> None:
    """Guard 1014h and 1028h: see `_check`."""
    _check(entry, value, _NOT_EMCY, is_valid)


def check_sdo_cob_id(entry: Entry, value: Value) -> None:
    """Guard 1201h to 127Fh: see `_check`."""
    _check(entry, value, _NOT_SDO, is_valid)


def check_time_cob_id(entry: Entry, value: Value) -> None:
    """Guard 1012h: see `_check`."""
    _check(entry, value, _NOT_SDO, takes_part)


def _check(entry: Entry, value: Value, unknown: int, in_use: Callable[[int], bool]) -> None:
    """Refuse with 0609 0030h what a COB-ID cannot be.

    That is: bits that are neither flags nor an 11-bit CAN-ID (29-bit CAN-IDs are not
    emulated), a restricted CAN-ID in use, and another CAN-ID while the old one is in use
    and stays so.
    """
    cob_id, old = value if isinstance(value, int) else unknown, entry.number
    can_id = cob_id & CAN_ID_MASK
    refused = in_use(cob_id) and (
        is_restricted(can_id) or (in_use(old) and can_id != old & CAN_ID_MASK)
    )
    if cob_id & unknown or refused:
        raise SdoAbort(AbortCode.VALUE_RANGE)
