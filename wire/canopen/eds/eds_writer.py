"""Write EDS and DCF files for the objects of a device (CiA 306)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import groupby
from operator import attrgetter
from typing import Final, Protocol

from tickrig.wire.canopen.eds import object_table
from tickrig.wire.canopen.eds.eds_value import format_limit, format_value, parse_value

_MANDATORY: Final = (0x1000, 0x1001, 0x1018)
_MANUFACTURER: Final = range(0x2000, 0x6000)
_IDENTITY: Final = ((1, "VendorNumber"), (2, "ProductNumber"), (3, "RevisionNumber"))
_SERIAL_NUMBER: Final = 4
_LSS_ADDRESS: Final = frozenset({1, 2, 3, _SERIAL_NUMBER})
"""Sub-indices of 1018h by which LSS selects a node (CiA 305)."""
_DUMMY_TYPES: Final = range(1, 8)
VARIABLES: Final = (object_table.ObjectCode.VAR, object_table.ObjectCode.DOMAIN)
_MAPPABLE: Final = object_table.Access.TPDO | object_table.Access.RPDO
_ACCESS_TYPES: Final = {
    object_table.Access.READ: "ro",
    object_table.Access.WRITE: "wo",
    object_table.Access.READ | object_table.Access.WRITE: "rw",
    object_table.Access.READ | object_table.Access.CONST: "const",
}

_NO_INFO: Final = object_table.DeviceInfo()

_NO_WORD: Final = re.compile(r"[^a-z0-9]+")


class Table(Protocol):
    """A table of `EntryDescription`: an `ObjectTable`, or the description of a dictionary."""

    @property
    def objects(self) -> Mapping[int, object_table.ObjectDescription]:
        """Names and kinds by index, sorted."""
        ...

    def __iter__(self) -> Iterator[object_table.EntryDescription]:
        """Return all entries, sorted by index and sub-index."""
        ...


def write_eds(
    table: Table, info: object_table.DeviceInfo = _NO_INFO, *, file_name: str = ""
) -> str:
    """Return the text of an EDS that describes the given objects with their default values.

    Two properties have no keyword in CiA 306, and are written as comments where they are needed.
    `MaxBytes` is the largest size of a string or domain. `DefaultBytes` is a default that a text
    cannot express. The date of the file is in 1970, so that the same dictionary always gives the
    same text.

    Args:
        table: the objects.
        info: vendor, product and bit rates for the sections `[FileInfo]` and `[DeviceInfo]`.
        file_name: value of `FileName`. If it is empty, or an EDS cannot hold it, `FileName` is made
            from the product name.

    Raises:
        ValueError: the name of an object cannot be written to an EDS, or CiA 306 has no word (such
            as `rw`) for the access of an object.

    >>> from tickrig.wire.canopen.eds.object_table import ObjectTable
    >>> text = write_eds(ObjectTable())
    >>> text.splitlines()[:2]
    ['[FileInfo]', 'FileName=device.eds']
    """
    return "\n".join([*_head(table, info, ".eds", file_name), *_objects(table)])


def write_dcf(
    table: Table,
    node_id: int,
    bit_rate: int,
    values: Mapping[int, bytes],
    info: object_table.DeviceInfo = _NO_INFO,
) -> str:
    """Return the text of a DCF: the objects of an EDS with the present values of one node.

    Args:
        table: the objects.
        node_id: node-ID of the node, 1..127.
        bit_rate: bit rate in bit/s.
        values: present values as bytes. The key is index << 8 | sub-index. An object that is not
            listed keeps its default value; a default that is relative to the node-ID gets the
            node-ID added.
        info: vendor, product and bit rates for the sections `[FileInfo]` and `[DeviceInfo]`.
    """
    commissioning = [
        "[DeviceComissioning]",
        *(f"NodeID={node_id}", "NodeName=", f"Baudrate={bit_rate // 1_000}"),
        *("NetNumber=0", "NetworkName=", "CANopenManager=0"),
        *(f"LSS_SerialNumber=0x{_identity(table).get(_SERIAL_NUMBER, 0):08X}", ""),
    ]
    present = {row.key: row.power_on_data(node_id) for row in table} | dict(values)
    objects = _objects(table, present)
    return "\n".join([*_head(table, info, ".dcf"), *commissioning, *objects])


def _head(
    table: Table, info: object_table.DeviceInfo, ending: str, file_name: str = ""
) -> Iterator[str]:
    yield from ("[FileInfo]", *_file_info(info, ending, file_name), "", "[DeviceInfo]")
    for key, text in (
        ("VendorName", info.vendor_name),
        ("ProductName", info.product_name),
        ("OrderCode", info.order_code),
    ):
        yield f"{key}={_name(text)}"
    numbers = _identity(table)
    for sub, key in _IDENTITY:
        yield f"{key}=0x{numbers.get(sub, 0):08X}"
    for kbit in object_table.BIT_RATES_KBIT:
        yield f"BaudRate_{kbit}={int(1_000 * kbit in info.bit_rates)}"
    for key, area in (("NrOfRXPDO", range(0x1400, 0x1600)), ("NrOfTXPDO", range(0x1800, 0x1A00))):
        yield f"{key}={sum(index in area for index in table.objects)}"
    yield from ("SimpleBootUpMaster=0", "SimpleBootUpSlave=1", "Granularity=1")
    yield from ("DynamicChannelsSupported=0", "GroupMessaging=0")
    yield from (f"LSS_Supported={int(numbers.keys() >= _LSS_ADDRESS)}", "")
    yield from ("[DummyUsage]", *(f"Dummy{kind:04d}=1" for kind in _DUMMY_TYPES), "")
    if comments := list(_comments(table)):
        yield from ("[Comments]", f"Lines={len(comments)}")
        yield from (f"Line{number}={text}" for number, text in enumerate(comments, 1))
        yield ""


def _identity(table: Table) -> dict[int, int]:
    """Return the numbers of 1018h by sub-index."""
    return {row.sub: int.from_bytes(row.default, "little") for row in table if row.index == 0x1018}


def _file_info(info: object_table.DeviceInfo, ending: str, file_name: str) -> Iterator[str]:
    name = _NO_WORD.sub("-", info.product_name.lower()).strip("-") or "device"
    given = file_name if _fits_a_line(file_name) else ""
    yield from (f"FileName={given or f'{name}{ending}'}", "FileVersion=1", "FileRevision=1")
    if ending == ".dcf":
        yield f"LastEDS={name}.eds"
    yield from ("EDSVersion=4.0", f"Description={_name(info.product_name)}")
    for what in ("Creation", "Modification"):
        yield from (f"{what}Time=12:00AM", f"{what}Date=01-01-1970")
    yield from ("CreatedBy=tickrig", "ModifiedBy=tickrig")


def _comments(table: Table) -> Iterator[str]:
    """Yield comments for properties without a CiA 306 keyword; `EdsFile` reads them."""
    for info, entries in _grouped(table):
        for entry, title in zip(entries, _titles(info, entries), strict=True):
            if entry.max_bytes != object_table.MAX_VARIABLE_BYTES:
                yield f"MaxBytes of {title} is {entry.max_bytes}"
            if _default(entry) is None:
                yield f"DefaultBytes of {title} is {entry.default.hex().upper()}"


def _objects(table: Table, values: Mapping[int, bytes] | None = None) -> Iterator[str]:
    mandatory = [index for index in table.objects if index in _MANDATORY]
    manufacturer = [index for index in table.objects if index in _MANUFACTURER]
    optional = [index for index in table.objects if index not in {*mandatory, *manufacturer}]
    for title, indices in (
        ("MandatoryObjects", mandatory),
        ("OptionalObjects", optional),
        ("ManufacturerObjects", manufacturer),
    ):
        yield from (f"[{title}]", f"SupportedObjects={len(indices)}")
        yield from (f"{number}=0x{index:04X}" for number, index in enumerate(indices, 1))
        yield ""
    for info, entries in _grouped(table):
        yield from _object(info, entries, values)


def _grouped(
    table: Table,
) -> Iterator[tuple[object_table.ObjectDescription, list[object_table.EntryDescription]]]:
    for index, entries in groupby(table, attrgetter("index")):
        yield table.objects[index], list(entries)


def _titles(
    info: object_table.ObjectDescription, entries: list[object_table.EntryDescription]
) -> list[str]:
    """Return the names of the sections of an object's entries."""
    head = f"{entries[0].index:04X}"
    if len(entries) == 1 and entries[0].sub == 0 and info.code in VARIABLES:
        return [head]
    return [f"{head}sub{entry.sub:X}" for entry in entries]


def _object(
    info: object_table.ObjectDescription,
    entries: list[object_table.EntryDescription],
    values: Mapping[int, bytes] | None,
) -> Iterator[str]:
    head, titles = f"{entries[0].index:04X}", _titles(info, entries)
    if titles == [head]:
        yield from _variable(head, info.code, entries[0], values)
        return
    code = object_table.ObjectCode.RECORD if info.code in VARIABLES else info.code
    yield from (f"[{head}]", f"ParameterName={_name(info.name)}")
    yield from (f"ObjectType=0x{code:X}", f"SubNumber={len(entries)}", "")
    for entry, title in zip(entries, titles, strict=True):
        yield from _variable(title, object_table.ObjectCode.VAR, entry, values)


def entry_lines(entry: object_table.EntryDescription) -> list[str]:
    """Return the lines of an EDS that describe one sub-index.

    Raises:
        ValueError: the name of the sub-index cannot be written to an EDS, or CiA 306 has no word
            (such as `rw`) for the access of the sub-index.

    >>> from tickrig.wire.canopen.eds.object_table import RO, DataType
    >>> entry_lines(object_table.EntryDescription(0x2000, 1, "x", DataType.UNSIGNED8, RO))[:2]
    ['[2000sub1]', 'ParameterName=x']
    """
    title = f"{entry.index:04X}sub{entry.sub:X}"
    return list(_variable(title, object_table.ObjectCode.VAR, entry, None))[:-1]


def _variable(
    title: str,
    code: object_table.ObjectCode,
    entry: object_table.EntryDescription,
    values: Mapping[int, bytes] | None,
) -> Iterator[str]:
    kind = entry.data_type
    yield from (f"[{title}]", f"ParameterName={_name(entry.name)}", f"ObjectType=0x{code:X}")
    yield from (f"DataType=0x{kind:04X}", f"AccessType={access_type(entry)}")
    yield f"PDOMapping={int(bool(entry.access & _MAPPABLE))}"
    yield f"DefaultValue={_default(entry) or ''}"
    if values is not None:
        value = format_value(kind, values[entry.key])
        yield f"ParameterValue={value if _fits_a_line(value) else ''}"
    if entry.low is not None:
        yield f"LowLimit={format_limit(kind, entry.low)}"
    if entry.high is not None:
        yield f"HighLimit={format_limit(kind, entry.high)}"
    yield ""


def access_type(entry: object_table.EntryDescription) -> str:
    """Return the access of an entry as a word of CiA 306 for an EDS, such as `rw` or `const`.

    Raises:
        ValueError: CiA 306 has no word for the access.

    >>> from tickrig.wire.canopen.eds.object_table import RWW, DataType, EntryDescription
    >>> access_type(EntryDescription(0x6040, 0, "Controlword", DataType.UNSIGNED16, RWW))
    'rww'
    """
    mappable = entry.access & _MAPPABLE
    name = _ACCESS_TYPES.get(entry.access & ~_MAPPABLE, "")
    if name == "rw" and mappable in (object_table.Access.TPDO, object_table.Access.RPDO):
        name = "rwr" if mappable is object_table.Access.TPDO else "rww"
    if not name or object_table.Access.from_eds(name, mappable=bool(mappable)) != entry.access:
        what = f"{entry.index:04X}h:{entry.sub:02X} {entry.name}"
        raise ValueError(f"an EDS cannot express the access of {what}: {entry.access}")
    return name


def _default(entry: object_table.EntryDescription) -> str | None:
    """Return the text of a default, or None if no text represents it exactly."""
    text = format_value(entry.data_type, entry.default, relative=entry.relative)
    return text if _reads_as(entry, text) else None


def _reads_as(entry: object_table.EntryDescription, text: str) -> bool:
    """Return whether reading restores a default exactly."""
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
    """Return whether reading restores a value in spite of blanks, comments and line ends."""
    return text.isprintable() and text == text.strip() and " ;" not in text
