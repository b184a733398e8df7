"""The configuration in a DCF: its values, its differences from a node, and writing it to a node."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Final

from tickrig.host.canopen.conform.write_order import PDOS, Write, in_order, is_too_long
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription
from tickrig.wire.canopen.nmt import INVALID

_Address = tuple[int, int]
Values = dict[_Address, bytes]

_COMMANDS: Final = (0x1003, 0x1010, 0x1011, *range(0x1F50, 0x1F58))
"""Objects that trigger an action when written: error history, store, restore, programs."""
_CONFIGURED: Final = 0x1020
"""Object "verify configuration". The date and time in this object are written last."""
_COB_ID: Final = 1
"""Sub-index of the communication parameter of a PDO."""
_TEXTS: Final = (DataType.VISIBLE_STRING, DataType.UNICODE_STRING)


def dcf_values(file: EdsFile, device: EdsDevice, node_id: int) -> Values:
    """Return the values to which a DCF sets the objects of a node, by index and sub-index.

    A DCF has these values in the keyword ParameterValue of the objects that can be written.

    Args:
        file: sections of the DCF.
        device: device that the DCF describes.
        node_id: node-ID of the node. It is added to values that the DCF gives relative to the
            node-ID.
    """
    sections = {(index, sub or 0): section for section, index, sub in file.objects()}
    return {
        (row.index, row.sub): row.power_on_data(node_id)
        for row in device.entries
        if row.writable and row.index not in _COMMANDS and _has_value(file, sections, row)
    }


def _has_value(file: EdsFile, sections: Mapping[_Address, str], row: EntryDescription) -> bool:
    section = sections.get((row.index, row.sub), f"{row.index:04X}")
    beside = file.value(f"{row.index:04X}Value", str(row.sub))
    return bool(file.value(section, "ParameterValue") or beside)


def is_parameter(row: EntryDescription) -> bool:
    """Return whether a dictionary entry is a setting, not process data or a command."""
    mapped = Access.RPDO in row.access or Access.TPDO in row.access
    kept = row.readable and row.writable and not mapped
    return kept and row.index not in _COMMANDS and row.data_type is not DataType.DOMAIN


def same(row: EntryDescription | None, wanted: bytes, found: bytes) -> bool:
    """Return whether two values are equal. Texts are compared without trailing zeros."""
    if row is not None and row.data_type in _TEXTS:
        return wanted.rstrip(b"\0") == found.rstrip(b"\0")
    return wanted == found


def disabled(done: Sequence[Write], left: Sequence[Write]) -> str:
    """Return a text about each PDO that stays disabled if no further configuration is written.

    Args:
        done: SDO writes that have been executed, including those that disabled PDOs.
        left: SDO writes that have not been executed, including those that would enable the PDOs
            again.
    """
    was = {at: data for at, data in done if at[1] == _COB_ID and at[0] in PDOS}
    will = {at: data for at, data in left if at[1] == _COB_ID and at[0] in PDOS}
    open_pdos = [at for at in was.keys() & will if _is_off(was[at]) and not _is_off(will[at])]
    return "".join(f"the PDO of {index:04X}h stays disabled" for index, _ in open_pdos)


def _is_off(data: bytes) -> bool:
    return bool(int.from_bytes(data, "little") & INVALID)


def writes(
    values: Mapping[_Address, bytes],
    number: Callable[[_Address], int],
    writable: Collection[_Address],
) -> list[Write]:
    """Return the SDO writes that configure a node, in an order that CiA 301 allows.

    The date of the configuration (1020h) is written last.

    Args:
        values: wanted value of each object, by index and sub-index.
        number: function that reads an object of the node as an unsigned number.
        writable: objects that the host can write. The result contains no writes to other objects,
            not even temporary writes, such as a write that disables a PDO while its parameters
            change.

    Raises:
        ValueError: a COB-ID or a number of mapped objects is invalid.
    """
    last = {at: data for at, data in values.items() if at[0] == _CONFIGURED}
    first = {at: values[at] for at in sorted(values) if at not in last}
    try:
        if any(is_too_long(at, data) for at, data in first.items()):
            raise OverflowError
        found = [(at, data) for at, data in in_order(first, number) if at in writable]
    except (OverflowError, ValueError):
        reason = "a COB-ID of more than 32 bits, or more than 255 mapped objects"
        raise ValueError(reason) from None
    return [*found, *last.items()]
