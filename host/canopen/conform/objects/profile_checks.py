"""Checks of 1000h: a device has the objects of the profile that it says it has."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from tickrig.host.canopen.conform.check import Check, Level, Step
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.object_table import EntryDescription

DEVICE_TYPE: Final = 0x1000
PROFILE_MASK: Final = 0xFFFF

IO_BLOCKS: Final[Mapping[int, tuple[int, ...]]] = {
    16: (0x6000, 0x6020, 0x6100, 0x6120),
    17: (0x6200, 0x6220, 0x6300, 0x6320),
    18: (0x6401, 0x6400, 0x6402, 0x6403, 0x6404),
    19: (0x6411, 0x6410, 0x6412, 0x6413, 0x6414),
}
"""Bits of 1000h of a device of CiA 401, and objects of which there is one if a bit is set."""

DRIVE_OBJECTS: Final = (0x6040, 0x6041)
"""Controlword and statusword: every drive has them."""


def profile_checks(device: EdsDevice, node_id: int) -> Iterator[Check]:
    """Give the check of 1000h, if the EDS says what it holds.

    Args:
        device: what the EDS says.
        node_id: of the node, 1..127.
    """
    entries = {(entry.index, entry.sub): entry for entry in device.entries}
    head = entries.get((DEVICE_TYPE, 0))
    if head is None or not head.has_default:
        return
    number = int.from_bytes(head.power_on_data(node_id), "little")
    wanted, source = _wanted(number, {index for index, _ in entries})
    if wanted:
        names = ", ".join(f"{index:04X}h" for index in wanted)
        title = f"1000h: has the objects of the profile that it names: {names}"
        clause, steps = f"CiA 301 v4.2.0, 7.5.2.1; {source}", tuple(_reads(entries, wanted))
        level = Level.READ_ONLY
        yield Check("OD-1000.00-profile", "OD", title, clause, level, frozenset(), steps)


def _wanted(number: int, present: set[int]) -> tuple[tuple[int, ...], str]:
    """Return the objects that a device type asks for, of several the one that is described."""
    match number & PROFILE_MASK:
        case 401:
            blocks = [objects for bit, objects in IO_BLOCKS.items() if number >> bit & 1]
            found = [[*present.intersection(objects), objects[0]][0] for objects in blocks]
            return tuple(found), "CiA 401-1, device type"
        case 402:
            return DRIVE_OBJECTS, "CiA 402-2, controlword and statusword"
    return (), ""


def _reads(
    entries: Mapping[tuple[int, int], EntryDescription], indices: Iterable[int]
) -> Iterator[Step]:
    for index in indices:
        entry = entries.get((index, 0))
        kind = "UNSIGNED8" if index not in DRIVE_OBJECTS else "UNSIGNED16"
        yield {"holds": f"{index:04X}:00", "type": entry.data_type.name if entry else kind}
