"""Object tables of devices, written as in their manuals, and the device data of an EDS."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import Flag, IntEnum
from operator import attrgetter
from typing import ClassVar, Final, NamedTuple

from tickrig._compiled import mypyc_attr
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.pdo import PdoDescription
from tickrig.wire.errors import FieldError

MAX_VARIABLE_BYTES: Final = 0xFFFF_FFFF
"""Default size limit of a string or domain: the most that SDO can transfer."""


class Access(Flag):
    """Access of the bus to an entry."""

    NONE = 0
    READ = 1
    WRITE = 2
    CONST = 4  # read, and never changed from the inside either
    TPDO = 8  # may be mapped into a TPDO
    RPDO = 16  # may be mapped into an RPDO

    @classmethod
    def from_eds(cls, access_type: str, *, mappable: bool = False) -> Access:
        """Return the access that an entry has according to its EDS (CiA 306).

        Args:
            access_type: access in CiA 306 notation: ro, wo, rw, rwr, rww or const, in upper or
                lower case.
            mappable: whether the entry can be mapped into PDOs (PDOMapping).

        Raises:
            ValueError: the access is unknown.
        """
        access = _ACCESS_TYPES.get(access_type.lower())
        if access is None:
            raise ValueError(
                f"access type {access_type!r} is not one of {', '.join(_ACCESS_TYPES)}"
            )
        if not mappable:
            return access
        return access | _MAPPABLE.get(access_type.lower(), cls.TPDO | cls.RPDO)


RO: Final = Access.READ
RW: Final = Access.READ | Access.WRITE
WO: Final = Access.WRITE
CONST: Final = Access.READ | Access.CONST
ROT: Final = RO | Access.TPDO
"""Access of an entry that is read only and may be mapped into a TPDO."""
RWW: Final = RW | Access.RPDO
"""Access of an entry that is read and written and may be mapped into an RPDO."""
RWRW: Final = RWW | Access.TPDO
"""Access of an entry that is read and written and may be mapped in both directions."""

_ACCESS_TYPES: Final = {"ro": RO, "wo": WO, "rw": RW, "rwr": RW, "rww": RW, "const": CONST}
_MAPPABLE: Final = {
    "ro": Access.TPDO,
    "const": Access.TPDO,
    "wo": Access.RPDO,
    "rwr": Access.TPDO,
    "rww": Access.RPDO,
}


class ObjectCode(IntEnum):
    """Kind of an object, as in an EDS."""

    DOMAIN = 0x2
    DEFTYPE = 0x5
    DEFSTRUCT = 0x6
    VAR = 0x7
    ARRAY = 0x8
    RECORD = 0x9


class ObjectDescription(NamedTuple):
    """Name and kind of an object."""

    name: str
    code: ObjectCode = ObjectCode.VAR


@mypyc_attr(serializable=True)
class EntryDescription:
    """Constant description of a variable, or of one element of an array or record (CiA 306).

    Args:
        index: index, 0x0000..0xFFFF.
        sub: sub-index, 0..255.
        name: name, as in the EDS.
        data_type: data type, which determines size and notation. It is DOMAIN if the type in a file
            is unknown.
        access: access of the bus.
        default: power-on value or its bytes. If omitted, it is zero, the nearest limit, or empty.
        low: smallest value, or None to use the limit of the data type.
        high: largest value, or None to use the limit of the data type.
        relative: whether the node-ID is added to the default ($NODEID).
        max_bytes: largest size of a string or domain.
        unit: unit of the value, or empty if unknown.
        factor: factor by which the number is multiplied to be in the unit.

    Raises:
        FieldError: the default is not a value of the data type.

    Attributes:
        default: bytes of the power-on value.
        has_default: whether a default was given.
        size: size in bytes, or 0 if the size varies.
        signed: whether the data type is a signed integer.
        readable: whether the bus may read the entry.
        writable: whether the bus may write the entry.
        shared_by_twins: flag that is always true: copies of a slave within the process share the
            description (`device/twin`).
        key: index and sub-index in one number.
    """

    __slots__ = (
        *("access", "data_type", "default", "factor", "has_default", "high", "index", "key"),
        *("low", "max_bytes", "name", "readable", "relative", "signed", "size", "sub"),
        *("unit", "writable"),
    )
    shared_by_twins: ClassVar[bool] = True

    def __init__(  # noqa: PLR0913 - a description, by keyword
        self,
        index: int,
        sub: int,
        name: str,
        data_type: DataType,
        access: Access,
        *,
        default: Value | None = None,
        low: int | float | None = None,
        high: int | float | None = None,
        relative: bool = False,
        max_bytes: int = MAX_VARIABLE_BYTES,
        unit: str = "",
        factor: int | float = 1,
    ) -> None:
        self.index, self.sub, self.key, self.name = index, sub, index << 8 | sub, name
        self.data_type, self.access = data_type, access
        self.size, self.signed = data_type.size, data_type.signed
        self.readable, self.writable = Access.READ in access, Access.WRITE in access
        self.has_default = default is not None
        if default is None:
            default = _nearest_to_zero(data_type, low, high)
        self.default = default if isinstance(default, bytes) else data_type.encode(default)
        self.low, self.high, self.relative, self.max_bytes = low, high, relative, max_bytes
        self.unit, self.factor = unit, factor

    def with_default(self, default: Value, *, relative: bool = False) -> EntryDescription:
        """Return a copy of this description with another power-on value.

        Args:
            default: power-on value, or its bytes.
            relative: whether the node-ID is added to the default.

        Returns:
            A new description of the entry.

        Raises:
            FieldError: the default is not a value of the data type.
        """
        return EntryDescription(
            *(self.index, self.sub, self.name, self.data_type, self.access),
            default=default,
            low=self.low,
            high=self.high,
            relative=relative,
            max_bytes=self.max_bytes,
            unit=self.unit,
            factor=self.factor,
        )

    def __repr__(self) -> str:
        """Return the name of the entry for a log line."""
        return f"<{self.index:04X}h:{self.sub:02X} {self.name}>"

    def power_on_data(self, node_id: int) -> bytes:
        """Return the bytes that the entry has at power-on in a given node.

        These are the bytes of the default. If the default is relative, the node-ID is added to it.

        Args:
            node_id: node-ID, 1 to 127.
        """
        if not self.relative:
            return self.default
        value = int.from_bytes(self.default, "little") + node_id
        return (value & (1 << 8 * self.size) - 1).to_bytes(self.size, "little")


def _nearest_to_zero(kind: DataType, low: int | float | None, high: int | float | None) -> bytes:
    """Return the bytes of an omitted default: 0, or the nearest limit."""
    nearest: int | float = 0
    if low is not None and low > 0:
        nearest = low
    elif high is not None and high < 0:
        nearest = high
    if nearest:
        with suppress(FieldError):  # a limit beyond the type, or of a text
            return kind.encode(round(nearest) if kind.is_integer else nearest)
    return bytes(kind.size)


class Element(NamedTuple):
    """Description of one sub-index of a record, for `ObjectTable.record`.

    Attributes:
        sub: sub-index, 1..254.
        name: name, as in the EDS.
        kind: data type of the element.
        access: access that the bus has to the element.
        default: power-on value.
        relative: whether the node-ID is added to the default.
    """

    sub: int
    name: str
    kind: DataType
    access: Access
    default: Value = 0
    relative: bool = False


@mypyc_attr(serializable=True)
class ObjectTable:
    """Builds the description of an object dictionary in code, object by object.

    Iterating over the table yields the descriptions of all entries, sorted by index and sub-index.

    Attributes:
        objects: names and object codes by index.

    >>> table = ObjectTable()
    >>> table.variable(0x1000, "Device type", DataType.UNSIGNED32, RO, 0x191)
    >>> table.array(0x6000, "Read input 8-bit", 2, DataType.UNSIGNED8, ROT)
    >>> [f"{row.index:04X}h:{row.sub:02X} {row.name}" for row in table][:2]
    ['1000h:00 Device type', '6000h:00 Number of entries']
    """

    def __init__(self) -> None:
        self._rows: list[EntryDescription] = []
        self._infos: dict[int, ObjectDescription] = {}

    def __iter__(self) -> Iterator[EntryDescription]:
        """Return all rows."""
        return iter(sorted(self._rows, key=attrgetter("key")))

    @property
    def objects(self) -> dict[int, ObjectDescription]:
        """Names and kinds by index, sorted."""
        return dict(sorted(self._infos.items()))

    def variable(  # noqa: PLR0913 - a row of an object table
        self,
        index: int,
        name: str,
        kind: DataType,
        access: Access,
        default: Value | None = None,
        *,
        low: int | float | None = None,
        high: int | float | None = None,
        relative: bool = False,
        max_bytes: int = MAX_VARIABLE_BYTES,
    ) -> None:
        """Add a variable."""
        self._infos[index] = ObjectDescription(name)
        row = EntryDescription(
            *(index, 0, name, kind, access),
            default=default,
            low=low,
            high=high,
            relative=relative,
            max_bytes=max_bytes,
        )
        self._rows.append(row)

    def array(  # noqa: PLR0913, PLR0917 - a row of an object table
        self,
        index: int,
        name: str,
        count: int,
        kind: DataType,
        access: Access,
        default: Value | None = None,
        *,
        max_bytes: int = MAX_VARIABLE_BYTES,
    ) -> None:
        """Add an array of equal elements, whose number is in sub-index 0."""
        self._head(index, name, ObjectCode.ARRAY, RO, count)
        self._rows += (
            EntryDescription(
                *(index, sub, f"{name} {sub}", kind, access), default=default, max_bytes=max_bytes
            )
            for sub in range(1, count + 1)
        )

    def record(  # noqa: PLR0913 - a row of an object table
        self,
        index: int,
        name: str,
        elements: Iterable[Element],
        *,
        count_access: Access = RO,
        count: int | None = None,
        code: ObjectCode = ObjectCode.RECORD,
    ) -> None:
        """Add a record to the table.

        Args:
            index: index of the record.
            name: name of the record.
            elements: descriptions of its sub-indices from 1 on.
            count_access: access of sub-index 0.
            count: value of sub-index 0, or None for the highest sub-index of the elements.
            code: object code. With the object code of an array, this method adds an array whose
                elements have individual names and defaults.
        """
        rows = list(elements)
        highest = max(row.sub for row in rows) if count is None else count
        self._head(index, name, code, count_access, highest)
        self._rows += (
            EntryDescription(index, sub, what, kind, access, default=default, relative=relative)
            for sub, what, kind, access, default, relative in rows
        )

    def _head(self, index: int, name: str, code: ObjectCode, access: Access, count: int) -> None:
        self._infos[index] = ObjectDescription(name, code)
        u8 = DataType.UNSIGNED8
        row = EntryDescription(index, 0, "Number of entries", u8, access, default=count)
        self._rows.append(row)


BIT_RATES_KBIT: Final = (10, 20, 50, 125, 250, 500, 800, 1000)
BIT_RATES: Final = frozenset(1_000 * kbit for kbit in BIT_RATES_KBIT)
"""All bit rates, in bit/s."""


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """Identity of a device in an EDS file: vendor, product and supported bit rates.

    Attributes:
        vendor_name: name of the vendor, or empty if unknown.
        product_name: name of the product, or empty if unknown.
        order_code: order code of the product, or empty if unknown.
        bit_rates: bit rates that the device supports, in bit/s.
    """

    vendor_name: str = ""
    product_name: str = ""
    order_code: str = ""
    bit_rates: frozenset[int] = frozenset()


# The communication objects of all our models (CiA 301, 1000h to 1FFFh).

U8: Final = DataType.UNSIGNED8
U16: Final = DataType.UNSIGNED16
U32: Final = DataType.UNSIGNED32
_TEXT: Final = DataType.VISIBLE_STRING

OFF: Final = 0x8000_0000
_ERRORS_KEPT: Final = 8
_CONSUMERS: Final = 4
_MAPPED: Final = 8
"""Number of entries in a mapping record."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CommunicationProfile:
    """Values of the communication objects (1000h..1FFFh) that differ from device to device.

    Attributes:
        device_type: value of 1000h.
        name: value of 1008h, the device name.
        hardware: value of 1009h, the hardware version.
        software: value of 100Ah, the software version.
        product_code: value of 1018h:02. The vendor-ID is 0, which belongs to no vendor.
        rpdos: descriptions of the RPDOs, from 1400h on.
        tpdos: descriptions of the TPDOs, from 1800h on.
        revision: value of 1018h:03, the revision number.
        heartbeat_ms: value of 1017h, the producer heartbeat time, in ms.
    """

    device_type: int
    name: str
    hardware: str
    software: str
    product_code: int
    rpdos: Sequence[PdoDescription]
    tpdos: Sequence[PdoDescription]
    revision: int = 0x1_0000
    heartbeat_ms: int = 0


def add_communication(objects: ObjectTable, profile: CommunicationProfile) -> None:
    """Add the objects of CiA 301: errors, heartbeat, SYNC, TIME, store, SDO server, PDOs."""
    _add_identity(objects, profile)
    _add_errors(objects)
    _add_supervision(objects, profile)
    for number, pdo in enumerate(profile.rpdos):
        _add_pdo(objects, "RPDO", 0x1400 + number, pdo, _rpdo_timing(pdo))
    for number, pdo in enumerate(profile.tpdos):
        _add_pdo(objects, "TPDO", 0x1800 + number, pdo, _tpdo_timing(pdo))


def _add_identity(objects: ObjectTable, profile: CommunicationProfile) -> None:
    objects.variable(0x1000, "Device type", U32, RO, profile.device_type)
    objects.variable(0x1008, "Manufacturer device name", _TEXT, CONST, profile.name)
    objects.variable(0x1009, "Manufacturer hardware version", _TEXT, CONST, profile.hardware)
    objects.variable(0x100A, "Manufacturer software version", _TEXT, CONST, profile.software)
    identity = (
        ("Vendor-ID", 0),
        ("Product code", profile.product_code),
        ("Revision number", profile.revision),
        ("Serial number", 1),
    )
    rows = [Element(sub, name, U32, RO, value) for sub, (name, value) in enumerate(identity, 1)]
    objects.record(0x1018, "Identity object", rows)


def _add_errors(objects: ObjectTable) -> None:
    objects.variable(0x1001, "Error register", U8, ROT)
    rows = [Element(sub, f"Error {sub}", U32, RO) for sub in range(1, _ERRORS_KEPT + 1)]
    title, code = "Pre-defined error field", ObjectCode.ARRAY
    objects.record(0x1003, title, rows, count_access=RW, count=0, code=code)
    objects.variable(0x1014, "COB-ID EMCY", U32, RW, 0x80, relative=True)
    objects.variable(0x1015, "Inhibit time EMCY", U16, RW)
    objects.array(0x1029, "Error behaviour", 1, U8, RW)


def _add_supervision(objects: ObjectTable, profile: CommunicationProfile) -> None:
    objects.variable(0x1005, "COB-ID SYNC", U32, RW, 0x80)
    objects.variable(0x1006, "Communication cycle period", U32, RW)
    objects.variable(0x1007, "Synchronous window length", U32, RW)
    objects.array(0x1010, "Store parameters", 1, U32, RW, 1)
    objects.array(0x1011, "Restore default parameters", 1, U32, RW, 1)
    objects.variable(0x100C, "Guard time", U16, RW)
    objects.variable(0x100D, "Life time factor", U8, RW)
    objects.array(0x1016, "Consumer heartbeat time", _CONSUMERS, U32, RW)
    objects.variable(0x1017, "Producer heartbeat time", U16, RW, profile.heartbeat_ms)
    rows = [
        Element(1, "COB-ID client to server", U32, RO, 0x600, relative=True),
        Element(2, "COB-ID server to client", U32, RO, 0x580, relative=True),
    ]
    objects.record(0x1200, "SDO server parameter", rows)


def _add_pdo(
    objects: ObjectTable, kind: str, index: int, pdo: PdoDescription, timing: list[Element]
) -> None:
    number = index % 0x200 + 1
    head = [
        Element(1, "COB-ID", U32, RW, pdo.cob_id, relative=pdo.relative),
        Element(2, "Transmission type", U8, RW, pdo.transmission_type),
    ]
    objects.record(index, f"{kind}{number} communication parameter", [*head, *timing])
    mapped = [*pdo.mapping, *[0] * (_MAPPED - len(pdo.mapping))]
    rows = [Element(sub, f"Object {sub}", U32, RW, value) for sub, value in enumerate(mapped, 1)]
    title = f"{kind}{number} mapping parameter"
    objects.record(index + 0x200, title, rows, count_access=RW, count=len(pdo.mapping))


def _rpdo_timing(pdo: PdoDescription) -> list[Element]:
    return [Element(5, "Event timer", U16, RW, pdo.event_ms)]


def _tpdo_timing(pdo: PdoDescription) -> list[Element]:
    return [
        Element(3, "Inhibit time", U16, RW, pdo.inhibit_100us),
        Element(5, "Event timer", U16, RW, pdo.event_ms),
        Element(6, "SYNC start value", U8, RW),
    ]
