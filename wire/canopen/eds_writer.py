"""EDS and DCF files out of the objects of a device (CiA 306)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from itertools import groupby
from operator import attrgetter
from typing import Final

from tickrig.wire.canopen.described import Described, Table
from tickrig.wire.canopen.device_info import BIT_RATES_KBIT, DeviceInfo
from tickrig.wire.canopen.eds_value import format_value, parse_value
from tickrig.wire.canopen.object_table import MAX_VARIABLE_BYTES, Access, ObjectCode, ObjectInfo

MANDATORY: Final = (0x1000, 0x1001, 0x1018)
MANUFACTURER: Final = range(0x2000, 0x6000)
IDENTITY: Final = ((1, "VendorNumber"), (2, "ProductNumber"), (3, "RevisionNumber"))
DUMMY_TYPES: Final = range(1, 8)
VARIABLES: Final = (ObjectCode.VAR, ObjectCode.DOMAIN)
MAPPABLE: Final = Access.TPDO | Access.RPDO
ACCESS_TYPES: Final = {
    Access.READ: "ro",
    Access.WRITE: "wo",
    Access.READ | Access.WRITE: "rw",
    Access.READ | Access.CONST: "const",
}

NO_INFO: Final = DeviceInfo()


def write_eds(table: Table, info: DeviceInfo = NO_INFO) -> str:
    """Write the objects with their default values.

    Two keywords are ours, since CiA 306 has none for them, and only where they
    are needed: `MaxBytes` limits a string or domain, `DefaultBytes` gives a
    default that no text can express. No date and file name are written: the
    same dictionary gives the same text.

    Raises:
        ValueError: a name or an access that an EDS cannot hold.

    >>> from tickrig.wire.canopen.object_table import ObjectTable
    >>> text = write_eds(ObjectTable())
    >>> text.splitlines()[:2]
    ['[FileInfo]', 'EDSVersion=4.0']
    """
    return "\n".join([*_head(table, info), *_objects(table, present=False)])


def write_dcf(table: Table, node_id: int, bit_rate: int, info: DeviceInfo = NO_INFO) -> str:
    """Write the objects with default and present values, for one node-ID; bit rate in bit/s."""
    commissioning = [
        "[DeviceComissioning]",
        f"NodeID={node_id}",
        f"Baudrate={bit_rate // 1_000}",
        "",
    ]
    objects = _objects(table, present=True)
    return "\n".join([*_head(table, info), *commissioning, *objects])


def _head(table: Table, info: DeviceInfo) -> Iterator[str]:
    yield from ("[FileInfo]", "EDSVersion=4.0", "", "[DeviceInfo]")
    for key, text in (
        ("VendorName", info.vendor_name),
        ("ProductName", info.product_name),
        ("OrderCode", info.order_code),
    ):
        yield f"{key}={_name(text)}"
    numbers = {row.sub: int.from_bytes(row.data, "little") for row in table if row.index == 0x1018}
    for sub, key in IDENTITY:
        yield f"{key}=0x{numbers.get(sub, 0):08X}"
    for kbit in BIT_RATES_KBIT:
        yield f"BaudRate_{kbit}={int(1_000 * kbit in info.bit_rates)}"
    for key, area in (("NrOfRXPDO", range(0x1400, 0x1600)), ("NrOfTXPDO", range(0x1800, 0x1A00))):
        yield f"{key}={sum(index in area for index in table.objects)}"
    yield from ("Granularity=1", "SimpleBootUpSlave=1", "LSS_Supported=1", "", "[DummyUsage]")
    yield from (f"Dummy{kind:04d}=1" for kind in DUMMY_TYPES)
    yield ""


def _objects(table: Table, *, present: bool) -> Iterator[str]:
    mandatory = [index for index in table.objects if index in MANDATORY]
    manufacturer = [index for index in table.objects if index in MANUFACTURER]
    optional = [index for index in table.objects if index not in {*mandatory, *manufacturer}]
    for title, indices in (
        ("MandatoryObjects", mandatory),
        ("OptionalObjects", optional),
        ("ManufacturerObjects", manufacturer),
    ):
        yield from (f"[{title}]", f"SupportedObjects={len(indices)}")
        yield from (f"{number}=0x{index:04X}" for number, index in enumerate(indices, 1))
        yield ""
    for index, entries in groupby(table, attrgetter("index")):
        yield from _object(table.objects[index], list(entries), present=present)


def _object(info: ObjectInfo, entries: list[Described], *, present: bool) -> Iterator[str]:
    index, single = entries[0].index, len(entries) == 1 and entries[0].sub == 0
    if single and info.code in VARIABLES:
        yield from _variable(f"{index:04X}", info.code, entries[0], present=present)
        return
    code = ObjectCode.RECORD if info.code in VARIABLES else info.code
    yield from (f"[{index:04X}]", f"ParameterName={_name(info.name)}")
    yield from (f"ObjectType=0x{code:X}", f"SubNumber={len(entries)}", "")
    for entry in entries:
        title = f"{index:04X}sub{entry.sub:X}"
        yield from _variable(title, ObjectCode.VAR, entry, present=present)


def _variable(title: str, code: ObjectCode, entry: Described, *, present: bool) -> Iterator[str]:
    kind = entry.data_type
    yield from (f"[{title}]", f"ParameterName={_name(entry.name)}", f"ObjectType=0x{code:X}")
    yield from (f"DataType=0x{kind:04X}", f"AccessType={_access_type(entry)}")
    yield f"PDOMapping={int(bool(entry.access & MAPPABLE))}"
    default = format_value(kind, entry.default, relative=entry.relative)
    exact = _reads_as(entry, default)
    yield f"DefaultValue={default if exact else ''}"
    if not exact:
        yield f"DefaultBytes={entry.default.hex().upper()}"
    if present:
        value = format_value(kind, entry.data)
        yield f"ParameterValue={value if _fits_a_line(value) else ''}"
    if entry.low is not None:
        yield f"LowLimit={entry.low}"
    if entry.high is not None:
        yield f"HighLimit={entry.high}"
    if entry.max_bytes != MAX_VARIABLE_BYTES:
        yield f"MaxBytes={entry.max_bytes}"
    yield ""


def _access_type(entry: Described) -> str:
    mappable = entry.access & MAPPABLE
    name = ACCESS_TYPES.get(entry.access & ~MAPPABLE, "")
    if name == "rw" and mappable in (Access.TPDO, Access.RPDO):
        name = "rwr" if mappable is Access.TPDO else "rww"
    if not name or Access.from_eds(name, mappable=bool(mappable)) != entry.access:
        what = f"{entry.index:04X}h:{entry.sub:02X} {entry.name}"
        raise ValueError(f"an EDS cannot express the access of {what}: {entry.access}")
    return name


def _reads_as(entry: Described, text: str) -> bool:
    """Say whether a default comes back exactly."""
    if not text:
        return not any(entry.default) and len(entry.default) == entry.data_type.size
    if _fits_a_line(text):
        with suppress(ValueError):
            value, relative = parse_value(entry.data_type, text)
            return entry.data_type.encode(value) == entry.default and relative is entry.relative
    return False


def _name(text: str) -> str:
    if not _fits_a_line(text):
        raise ValueError(f"an EDS cannot hold the name {text!r}")
    return text


def _fits_a_line(text: str) -> bool:
    """Say whether a value survives blanks, comments and line ends of an EDS."""
    return text.isprintable() and text == text.strip() and " ;" not in text
