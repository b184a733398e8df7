r"""RTC on CANopen: types of ports, the profile of a component and its objects.

Data types of ports and of the objects that carry them (NEDO report, 3.4.43.3, Table 4).

>>> SHORT.encode(-2), FLOAT.decode([bytes.fromhex("0000C03F")])
((b'\xfe\xff',), 1.5)
>>> SHORT.sequence(2).decode([b"\x01\x00", b"\xff\xff"])
(1, -1)

The objects of a DeviceRTC, made from its profile (DECISION K2, K3, K17).

>>> table = object_table(RtcProfile(type_name="Empty"))
>>> {f"{row.index:04X}h": row.default.decode() for row in table if row.index == 0x1008}
{'1008h': 'Empty'}
"""

from __future__ import annotations

import re
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, StrEnum
from types import MappingProxyType
from typing import Any, Final, Generic, TypeVar, cast

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import (
    BIT_RATES,
    MAX_VARIABLE_BYTES,
    OFF,
    RO,
    ROT,
    RW,
    RWW,
    CommunicationProfile,
    DeviceInfo,
    ObjectTable,
    add_communication,
)
from tickrig.wire.canopen.nmt import is_restricted
from tickrig.wire.canopen.pdo import MAX_PDO_BITS, MappedObject, PdoDescription
from tickrig.wire.errors import FieldError

T = TypeVar("T")

MAX_TEXT: Final = 255
"""Largest number of characters of a text port, which is our choice."""


@dataclass(frozen=True, slots=True)
class CanopenPortType(Generic[T]):
    """The data type of a port of a DeviceRTC.

    Each element of a value is a separate sub-index in the object dictionary.

    Attributes:
        name: name of the RTC type, such as `UnsignedShort`.
        data_type: CANopen data type of an element.
        kind: Python type of an element.
        length: number of elements.
        many: whether a value is a tuple of `length` elements. Otherwise a value is a single
            element.
        width: number of bits of an element, or 0 to use the number of bits of `data_type`.

    Raises:
        ValueError: `length` is less than 1.
    """

    name: str
    data_type: DataType
    kind: type[Any]
    length: int = 1
    many: bool = False
    width: int = 0

    def __post_init__(self) -> None:
        """Refuse an empty sequence."""
        if self.length < 1:
            raise ValueError(f"a sequence of {self.length} elements, at least 1 is needed")

    def sequence(self, length: int) -> CanopenPortType[tuple[T, ...]]:
        """Return the sequence type with a given number of elements (DECISION K3)."""
        return CanopenPortType(
            self.name, self.data_type, self.kind, length, many=True, width=self.width
        )

    @property
    def element_bits(self) -> int:
        """Number of bits of an element in Table 4, or 0 for a text."""
        return self.width or self.data_type.bits

    @property
    def bits(self) -> int:
        """Number of bits that a value has in a PDO.

        It is 0 for a text, because a text does not fit into a PDO.
        """
        return self.element_bits * self.length

    @property
    def max_bytes(self) -> int:
        """Largest size of an element in the dictionary."""
        if self.element_bits:
            return (self.element_bits + 7) // 8
        return len(self.data_type.encode(" " * MAX_TEXT))

    @property
    def default(self) -> bytes:
        """Bytes of an element at power-on, which are 0 or an empty text."""
        return bytes(self.max_bytes if self.element_bits else 0)

    def encode(self, value: T) -> tuple[bytes, ...]:
        """Return the bytes of each element; raise FieldError if the value has another type."""
        items: Any = value if self.many else (value,)
        if len(items) != self.length:
            raise FieldError(f"{len(items)} elements of {self.name}, {self.length} are needed")
        elements = tuple(self.data_type.encode(item) for item in items)
        for item, data in zip(items, elements, strict=True):
            if len(data) > self.max_bytes or (self.width and len(data) != self.max_bytes):
                allowed = f"at most {MAX_TEXT} characters" if not self.width else "one of 16 bits"
                raise FieldError(f"{item!r} is no {self.name}, which has {allowed}")
        return elements

    def decode(self, elements: Sequence[bytes]) -> T:
        """Return the value from the bytes of all elements."""
        items = [self.data_type.decode(data) for data in elements]
        values = tuple(bool(item) if self.kind is bool else item for item in items)
        return cast(T, values if self.many else values[0])


def _row(name: str, data_type: DataType, kind: type[T], width: int = 0) -> CanopenPortType[T]:
    return CanopenPortType(name, data_type, kind, width=width)


BOOLEAN: Final = _row("Boolean", DataType.BOOLEAN, bool)
OCTET: Final = _row("Octet", DataType.UNSIGNED8, int)
CHARACTER: Final = _row("Character", DataType.VISIBLE_CHAR, str)
SHORT: Final = _row("Short", DataType.INTEGER16, int)
UNSIGNED_SHORT: Final = _row("UnsignedShort", DataType.UNSIGNED16, int)
FLOAT: Final = _row("Float", DataType.REAL32, float)
LONG: Final = _row("Long", DataType.INTEGER32, int)
UNSIGNED_LONG: Final = _row("UnsignedLong", DataType.UNSIGNED32, int)
DOUBLE: Final = _row("Double", DataType.REAL64, float)
UNSIGNED_LONG_LONG: Final = _row("UnsignedLongLong", DataType.UNSIGNED64, int)
LONG_LONG: Final = _row("LongLong", DataType.INTEGER64, int)
STRING: Final = _row("String", DataType.VISIBLE_STRING, str)
WIDE_CHARACTER: Final = _row("WideCharacter", DataType.UNICODE_STRING, str, width=16)
WIDE_STRING: Final = _row("WideString", DataType.UNICODE_STRING, str)

PORT_TYPES: Final[Mapping[str, CanopenPortType[Any]]] = MappingProxyType(
    {
        row.name: row
        for row in (
            *(BOOLEAN, OCTET, CHARACTER, SHORT, UNSIGNED_SHORT, FLOAT, LONG, UNSIGNED_LONG),
            *(DOUBLE, UNSIGNED_LONG_LONG, LONG_LONG, STRING, WIDE_CHARACTER, WIDE_STRING),
        )
    }
)
"""Types of Table 4 by RTC name, without Integer. LongLong is our addition (DECISION K5)."""

INTEGER: Final = "Integer"
_INTEGERS: Final = {8: DataType.INTEGER8, 16: DataType.INTEGER16, 32: DataType.INTEGER32}


def integer(word_bits: int) -> CanopenPortType[int]:
    """Return the port type Integer for a device whose processor has the given word size.

    A value of this type has as many bits as a word of the processor. See the NEDO report, 3.4.43.3,
    Table 4, note 1.

    Args:
        word_bits: word size in bits.

    Raises:
        ValueError: the word size is not 8, 16 or 32.
    """
    if word_bits not in _INTEGERS:
        raise ValueError(f"a word of {word_bits} bits; Integer has 8, 16 or 32")
    return CanopenPortType(INTEGER, _INTEGERS[word_bits], int)


# The profile of a DeviceRTC, and the place of its ports in the dictionary (DECISION K2, K3, K17).

FIRST_PORT: Final = 0x2100
"""Index of the first port; the other ports follow in order of declaration."""

_PORT_OBJECTS: Final = range(FIRST_PORT, 0x6000)
"""Indices of ports, up to the end of the manufacturer-specific objects (CiA 301)."""

_MOST_PDOS: Final = 512
"""Largest number of PDOs in each direction (CiA 301: 1400h to 15FFh, 1800h to 19FFh)."""

MOST_ELEMENTS: Final = 254
"""Largest number of elements of an array (CiA 301)."""

_PREDEFINED_PDOS: Final = 4
"""Number of PDOs in each direction with a COB-ID of the pre-defined connection set."""

_CAN_IDS: Final = range(0x181, 0x6E0)

_DUMMY_BIT: Final = MappedObject(DataType.BOOLEAN, 0, 1).encode()
_RATE_HZ: Final = range(1, 1001)
_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,31}")
_VERSION: Final = re.compile(r"[0-9]{1,4}\.[0-9]{1,4}(\.[0-9]{1,4})?")


class PortDirection(Enum):
    """Direction of the data, from the point of view of the device."""

    IN = "in"
    OUT = "out"


class PortTransport(StrEnum):
    """Transport of the values of a port."""

    PDO = "pdo"
    SDO = "sdo"


@dataclass(frozen=True, slots=True)
class CanopenPortProfile:
    """Declaration of a port of a DeviceRTC: name, direction, type and transport.

    Attributes:
        name: name of the port: a letter, then up to 31 letters, digits and underscores.
        direction: direction of the port: in-port or out-port.
        port_type: type of the values.
        cob_id: CAN-ID of the PDO, or None to use the CAN-ID of the pre-defined connection set.
        transport: transport of the values. None selects a PDO if the type fits into one PDO, or
            else SDO.
    """

    name: str
    direction: PortDirection
    port_type: CanopenPortType[Any]
    cob_id: int | None = None
    transport: PortTransport | None = None

    @property
    def fits_pdo(self) -> bool:
        """Whether a value fits into a PDO."""
        return 0 < self.port_type.bits <= MAX_PDO_BITS

    @property
    def by_sdo(self) -> bool:
        """Whether the object of the port is read and written by SDO only."""
        return self.transport is PortTransport.SDO or not self.fits_pdo


@dataclass(frozen=True, slots=True)
class PlacedPort:
    """A port of a DeviceRTC with the object and the PDO that are assigned to it.

    Attributes:
        profile: declaration of the port.
        index: index of the object.
        number: number of the RPDO or TPDO, 1..512, or 0 without a PDO.
    """

    profile: CanopenPortProfile
    index: int
    number: int

    @property
    def relative(self) -> bool:
        """Whether the node-ID is added to the COB-ID."""
        return self.profile.cob_id is None and 0 < self.number <= _PREDEFINED_PDOS

    @property
    def cob_id(self) -> int | None:
        """CAN-ID of the port's PDO, or None if the PDO is off.

        An in-port has an RPDO, and an out-port has a TPDO. If `relative` is true, the node-ID must
        be added to the CAN-ID.
        """
        if not self.relative:
            return self.profile.cob_id
        first = 0x200 if self.profile.direction is PortDirection.IN else 0x180
        return first + 0x100 * (self.number - 1)

    @property
    def subs(self) -> tuple[int, ...]:
        """Sub-indices of the object that contain the elements of the port's value.

        A value with one element has the sub-index 0. The elements of an array have the sub-indices
        from 1 on.
        """
        length = self.profile.port_type.length
        return (0,) if length == 1 else tuple(range(1, length + 1))

    @property
    def mapping(self) -> tuple[int, ...]:
        """Entries of the mapping parameter of the port's PDO.

        Each Boolean has one bit (NEDO report, Table 4). Dummy bits pad the last byte of an RPDO. A
        TPDO cannot have dummy bits (CiA 301), so its last byte ends with unmapped zeros.
        """
        kind = self.profile.port_type
        mapped = [MappedObject(self.index, sub, kind.element_bits).encode() for sub in self.subs]
        gap = -kind.bits % 8 if self.profile.direction is PortDirection.IN else 0
        return (*mapped, *[_DUMMY_BIT] * gap)


@dataclass(frozen=True, slots=True, kw_only=True)
class RtcProfile:
    """The profile of a component on a CANopen device: its name, version, rate and ports.

    Attributes:
        type_name: type of the component, spelled like the name of a port. It is the value of 1008h.
        version: version such as 1.0 or 1.0.2. It is the value of 100Ah, and of the revision number
            1018h:03.
        vendor: maker of the component, for the EDS.
        category: description as readable text.
        rate_hz: rate at which `on_execute` runs, 1..1000 Hz.
        product_code: value of 1018h:02. The default is the CRC-32 of the type name.
        ports: ports in order of declaration.

    Raises:
        ValueError: a value is invalid. The message has one line with the value and the allowed
            values.
    """

    type_name: str
    version: str = "1.0"
    vendor: str = ""
    category: str = ""
    rate_hz: int = 100
    product_code: int = 0
    ports: tuple[CanopenPortProfile, ...] = ()

    def __post_init__(self) -> None:
        """Check the profile (DECISION K17)."""
        _check_name("type_name", self.type_name)
        if not _VERSION.fullmatch(self.version):
            raise ValueError(f"version {self.version!r} is not like 1.0 or 1.0.2")
        for what, text in (("vendor", self.vendor), ("category", self.category)):
            if not _fits_a_line(text):
                raise ValueError(f"{what} {text!r} is not one line of ASCII")
        if self.rate_hz not in _RATE_HZ:
            raise ValueError(f"rate_hz {self.rate_hz} is not in 1..{_RATE_HZ[-1]}")
        if not 0 <= self.product_code <= 0xFFFF_FFFF:
            raise ValueError(f"product_code {self.product_code} is not in 0..0xFFFFFFFF")
        _check_ports(self.ports)

    @property
    def code(self) -> int:
        """Product code, 1018h:02."""
        return self.product_code or zlib.crc32(self.type_name.encode())

    @property
    def revision(self) -> int:
        """Revision number, 1018h:03: major and minor version in 16 bits each."""
        major, minor = self.version.split(".")[:2]
        return int(major) << 16 | int(minor)

    def placed(self, direction: PortDirection | None = None) -> tuple[PlacedPort, ...]:
        """Return the ports with the objects and PDOs that are assigned to them.

        Args:
            direction: direction of the returned ports, or None. With a direction, ports without a
                PDO are left out. With None, all ports are returned.
        """
        return tuple(
            port
            for port in self._place()
            if direction is None or (port.number and port.profile.direction is direction)
        )

    def _place(self) -> Iterator[PlacedPort]:
        numbers = Counter[PortDirection]()
        for index, port in enumerate(self.ports, FIRST_PORT):
            numbers[port.direction] += not port.by_sdo
            yield PlacedPort(port, index, 0 if port.by_sdo else numbers[port.direction])


def _check_ports(ports: tuple[CanopenPortProfile, ...]) -> None:
    for name, count in Counter(port.name for port in ports).items():
        if count > 1:
            raise ValueError(f"{count} ports are called {name!r}")
    for port in ports:
        _check_port(port)
    for direction in PortDirection:
        pdos: int = sum(port.direction is direction and not port.by_sdo for port in ports)
        if pdos > _MOST_PDOS:
            raise ValueError(f"{pdos} {direction.value}-ports with a PDO, there are {_MOST_PDOS}")
    if len(ports) > len(_PORT_OBJECTS):
        raise ValueError(f"{len(ports)} ports, there are objects for {len(_PORT_OBJECTS)}")
    given = Counter(port.cob_id for port in ports if port.cob_id is not None)
    for cob_id, count in given.items():
        if count > 1:
            raise ValueError(f"cob_id {cob_id:03X}h belongs to {count} ports; give each its own")


def _check_port(port: CanopenPortProfile) -> None:
    _check_name("port", port.name)
    kind = port.port_type
    if kind.length > MOST_ELEMENTS:
        raise ValueError(
            f"port {port.name}: {kind.length} elements, an array has {MOST_ELEMENTS} at most"
        )
    if port.transport is PortTransport.PDO and not port.fits_pdo:
        what = f"{kind.length} x {kind.name} are {kind.bits} bits" if kind.bits else kind.name
        raise ValueError(
            f"port {port.name}: {what}, a PDO has {MAX_PDO_BITS} bits; take transport sdo"
        )
    if port.cob_id is None:
        return
    if port.by_sdo:
        raise ValueError(f"port {port.name}: it has no PDO for cob_id {port.cob_id:03X}h")
    if port.cob_id not in _CAN_IDS or is_restricted(port.cob_id):
        raise ValueError(
            f"port {port.name}: cob_id {port.cob_id:03X}h is not in 181h..6DFh, or is one of "
            "581h..5FFh and 601h..67Fh, which belong to SDO"
        )


def _check_name(what: str, name: str) -> None:
    if not _NAME.fullmatch(name):
        raise ValueError(
            f"{what} {name!r} is not a letter and up to 31 letters, digits and underscores"
        )


def _fits_a_line(text: str) -> bool:
    """Return whether EDS, C and YAML can contain a text unchanged."""
    return text.isascii() and text.isprintable() and text == text.strip() and ";" not in text


_NO_PROFILE: Final = 0
"""Device type of a device without a standardised profile (CiA 301, object 1000h)."""

_HEARTBEAT_MS: Final = 100
"""Producer heartbeat time (DECISION K14)."""


def object_table(profile: RtcProfile) -> ObjectTable:
    """Return the objects of a DeviceRTC: those of CiA 301, and one per port (from 2100h on)."""
    table = ObjectTable()
    communication = CommunicationProfile(
        device_type=_NO_PROFILE,
        name=profile.type_name,
        hardware="DeviceRTC",
        software=profile.version,
        product_code=profile.code,
        revision=profile.revision,
        heartbeat_ms=_HEARTBEAT_MS,
        rpdos=_pdos(profile, PortDirection.IN),
        tpdos=_pdos(profile, PortDirection.OUT),
    )
    add_communication(table, communication)
    for port in profile.placed():
        _add_port(table, port)
    return table


def device_info(profile: RtcProfile) -> DeviceInfo:
    """Return vendor, product and bit rates for the EDS."""
    return DeviceInfo(profile.vendor, profile.type_name, bit_rates=BIT_RATES)


def _pdos(profile: RtcProfile, direction: PortDirection) -> list[PdoDescription]:
    return [
        PdoDescription(
            OFF if port.cob_id is None else port.cob_id, port.mapping, relative=port.relative
        )
        for port in profile.placed(direction)
    ]


_ACCESS: Final = {
    (PortDirection.IN, False): RWW,
    (PortDirection.OUT, False): ROT,
    (PortDirection.IN, True): RW,
    (PortDirection.OUT, True): RO,
}
"""Access by direction and by SDO-only transport."""


def _add_port(table: ObjectTable, port: PlacedPort) -> None:
    kind, name = port.profile.port_type, port.profile.name
    access = _ACCESS[port.profile.direction, port.profile.by_sdo]
    default, most = None, MAX_VARIABLE_BYTES
    if not kind.data_type.size:
        default, most = kind.default, kind.max_bytes
    if kind.length == 1:
        table.variable(port.index, name, kind.data_type, access, default, max_bytes=most)
    else:
        table.array(port.index, name, kind.length, kind.data_type, access, default, max_bytes=most)
