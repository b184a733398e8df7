"""Dictionaries out of EDS and DCF files."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from canopen.objectdictionary import ODArray, ODRecord, ODVariable

from tickrig.device.canopen.dictionary import Dictionary, ObjectInfo
from tickrig.device.canopen.entry import MAX_VARIABLE_BYTES, Access, Entry
from tickrig.emulators.canopen.device_description import DeviceDescription
from tickrig.emulators.canopen.eds_file import EdsFile
from tickrig.emulators.canopen.eds_objects import (
    Kinds,
    import_objects,
    is_visible_char,
    object_kinds,
)
from tickrig.emulators.canopen.predefined import COUNTS, predefined
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.device_info import BIT_RATES_KBIT, DeviceInfo
from tickrig.wire.canopen.eds_value import parse_limit, parse_value

COMMISSIONING: Final = "DeviceComissioning"
UNSET_NODE_IDS: Final = (0, 0xFF)
HIGHEST_SUB: Final = 254
ERROR_FIELD: Final = 0x1003

Object = ODVariable | ODArray | ODRecord


def read_eds(path: Path) -> DeviceDescription:
    """Read an EDS or DCF file.

    Raises:
        OSError: the file cannot be read.
        EdsError: it is malformed.
    """
    return describe(EdsFile.read(path))


def describe(file: EdsFile) -> DeviceDescription:
    """Describe the device of an EDS or DCF.

    The canopen library finds the objects, their data types and access; what it
    drops is read here: values and limits of every type, `$NODEID` sums,
    CompactSubObj, NodeID and Baudrate. A ParameterValue (DCF) counts as
    power-on value. Where no default is given, a COB-ID gets that of the
    pre-defined connection set and a sub-index 0 the number of entries. ObjFlags
    concern configuration tools, not the device, and are not kept.

    Raises:
        EdsError: it is malformed.
    """
    kinds = object_kinds(file)
    found = import_objects(file, kinds)
    entries = [entry for item in found.values() for entry in _entries(file, item)]
    return DeviceDescription(
        file.name,
        _device_info(file),
        Dictionary(entries, _names(file, kinds)),
        _node_id(file),
        1_000 * file.number(COMMISSIONING, "Baudrate") or None,
    )


def _names(file: EdsFile, kinds: Kinds) -> dict[int, ObjectInfo]:
    return {
        index: ObjectInfo(file.value(f"{index:04X}", "ParameterName"), kind)
        for index, kind in kinds.items()
    }


def _device_info(file: EdsFile) -> DeviceInfo:
    rates = {
        1_000 * kbit for kbit in BIT_RATES_KBIT if file.number("DeviceInfo", f"BaudRate_{kbit}")
    }
    return DeviceInfo(
        vendor_name=file.value("DeviceInfo", "VendorName"),
        product_name=file.value("DeviceInfo", "ProductName"),
        order_code=file.value("DeviceInfo", "OrderCode"),
        bit_rates=frozenset(rates),
    )


def _node_id(file: EdsFile) -> int | None:
    node_id = file.number(COMMISSIONING, "NodeID")
    if node_id in UNSET_NODE_IDS:
        return None
    if not 1 <= node_id <= 127:
        raise file.error(COMMISSIONING, f"NodeID={node_id} is not in 1..127")
    return node_id


def _entries(file: EdsFile, item: Object) -> Iterator[Entry]:
    """Make the entries of one object."""
    section = f"{item.index:04X}"
    if isinstance(item, ODVariable):
        yield _entry(file, section, item)
    elif file.number(section, "CompactSubObj"):
        yield from _compact(file, section, item)
    else:
        highest = max(item.subindices, default=0)
        for sub, variable in item.subindices.items():
            yield _entry(file, f"{section}sub{sub:X}", variable, highest)


def _compact(file: EdsFile, section: str, item: ODArray | ODRecord) -> Iterator[Entry]:
    """Make an array that is described by one of its elements."""
    count = min(file.number(section, "CompactSubObj"), HIGHEST_SUB)
    element, u8 = item.subindices[1], DataType.UNSIGNED8
    if item.index == ERROR_FIELD:
        yield Entry(item.index, 0, "Number of errors", u8, Access.READ | Access.WRITE)
    else:
        yield Entry(item.index, 0, "Number of entries", u8, Access.READ, default=count)
    for sub in range(1, count + 1):
        element.subindex = sub
        element.name = file.value(f"{section}Name", str(sub)) or f"{item.name}{sub}"
        yield _entry(file, section, element)


def _entry(file: EdsFile, section: str, variable: ODVariable, highest: int = 0) -> Entry:
    """Make an entry; `highest` is the last sub-index of its object."""
    kind = _data_type(file, section, variable)
    low, high = _limits(file, section, kind)
    max_bytes = file.number(section, "MaxBytes", MAX_VARIABLE_BYTES)
    default, relative = _default(file, section, variable, kind)
    if default is None and kind.is_integer:
        default, relative = _implied(variable, highest)
    try:
        access = Access.from_eds(variable.access_type, mappable=variable.pdo_mappable)
        entry = Entry(
            *(variable.index, variable.subindex, variable.name, kind, access),
            default=default,
            low=low,
            high=high,
            relative=relative,
            max_bytes=max_bytes,
        )
    except ValueError as error:
        raise file.error(section, str(error)) from error
    exact = file.value(section, "DefaultBytes")
    if exact:
        entry.default = entry.data = _hexadecimal(file, section, exact)
    return entry


def _hexadecimal(file: EdsFile, section: str, text: str) -> bytes:
    try:
        return bytes.fromhex(text)
    except ValueError as error:
        raise file.error(section, f"DefaultBytes={text} is no hexadecimal bytes") from error


def _data_type(file: EdsFile, section: str, variable: ODVariable) -> DataType:
    if is_visible_char(file, section):
        return DataType.VISIBLE_CHAR
    try:
        return DataType(variable.data_type or 0)
    except ValueError as error:
        number = variable.data_type or 0
        raise file.error(section, f"DataType=0x{number:04X} is unknown") from error


def _default(
    file: EdsFile, section: str, variable: ODVariable, kind: DataType
) -> tuple[Value | None, bool]:
    """Return the power-on value of the file, and whether it is relative to the node-ID."""
    for place, key in (
        (section, "ParameterValue"),
        (f"{variable.index:04X}Value", str(variable.subindex)),
        (section, "DefaultValue"),
    ):
        if file.value(place, key):
            return _value(file, place, key, kind)
    return None, False


def _implied(variable: ODVariable, highest: int) -> tuple[Value | None, bool]:
    """Return the power-on value of an object whose EDS gives none."""
    index, sub = variable.index, variable.subindex
    if sub == 0 and highest and index not in COUNTS:
        return highest, False
    return predefined(index, sub) or (None, False)


def _value(file: EdsFile, section: str, key: str, kind: DataType) -> tuple[Value, bool]:
    text = file.value(section, key)
    try:
        value, relative = parse_value(kind, text)
        kind.encode(value)
    except (ValueError, OverflowError) as error:
        raise file.error(section, f"{key}={text} is no {kind.name}") from error
    return value, relative


def _limits(file: EdsFile, section: str, kind: DataType) -> tuple[float | None, float | None]:
    """Return the limits of a number; other types have none."""
    limits: list[float | None] = []
    for key in ("LowLimit", "HighLimit"):
        text = file.value(section, key)
        try:
            limits.append(parse_limit(kind, text) if text else None)
        except (ValueError, OverflowError) as error:
            raise file.error(section, f"{key}={text} is no {kind.name}") from error
    low, high = limits
    if low is not None and high is not None and low > high:
        raise file.error(section, f"LowLimit {low} is above HighLimit {high}")
    return low, high
