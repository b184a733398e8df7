"""The profile of a DeviceRTC, and where its ports are in the dictionary (DECISION K2, K3, K17)."""

from __future__ import annotations

import re
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum, StrEnum
from typing import Any, Final

from tickrig.wire.canopen.cob_id import is_restricted
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.pdo import MAX_PDO_BITS, MappedObject
from tickrig.wire.rtc_canopen.port_types import CanopenPortType

FIRST_PORT: Final = 0x2100
"""Index of the first port; the others follow in order of declaration."""

PORT_OBJECTS: Final = range(FIRST_PORT, 0x6000)
"""Up to the end of the manufacturer's objects (CiA 301)."""

MOST_PDOS: Final = 512
"""Each way (CiA 301: 1400h to 15FFh, 1800h to 19FFh)."""

MOST_ELEMENTS: Final = 254
"""Sub-indices of an array (CiA 301)."""

PREDEFINED_PDOS: Final = 4
"""Each way: the pre-defined connection set has COB-IDs for so many."""

CAN_IDS: Final = range(0x181, 0x6E0)

_DUMMY_BIT: Final = MappedObject(DataType.BOOLEAN, 0, 1).encode()
RATE_HZ: Final = range(1, 1001)
_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,31}")
_VERSION: Final = re.compile(r"[0-9]{1,4}\.[0-9]{1,4}(\.[0-9]{1,4})?")


class PortDirection(Enum):
    """Way of the data, seen from the device."""

    IN = "in"
    OUT = "out"


class PortTransport(StrEnum):
    """What carries the values of a port."""

    PDO = "pdo"
    SDO = "sdo"


@dataclass(frozen=True, slots=True)
class CanopenPortProfile:
    """A port as it is declared.

    Attributes:
        name: a letter, then up to 31 letters, digits and underscores.
        direction: in-port or out-port.
        port_type: type of its values.
        cob_id: CAN-ID of its PDO; None for that of the pre-defined connection set.
        transport: None for a PDO if the type fits into one, else SDO.
    """

    name: str
    direction: PortDirection
    port_type: CanopenPortType[Any]
    cob_id: int | None = None
    transport: PortTransport | None = None

    @property
    def fits_pdo(self) -> bool:
        """Whether a PDO has room for a value."""
        return 0 < self.port_type.bits <= MAX_PDO_BITS

    @property
    def by_sdo(self) -> bool:
        """Whether its object is read and written by SDO alone."""
        return self.transport is PortTransport.SDO or not self.fits_pdo


@dataclass(frozen=True, slots=True)
class PlacedPort:
    """A port with its objects and its PDO.

    Attributes:
        profile: the port.
        index: of its object.
        number: of its RPDO or TPDO, 1..512; 0 without one.
    """

    profile: CanopenPortProfile
    index: int
    number: int

    @property
    def relative(self) -> bool:
        """Whether the node-ID is added to the COB-ID."""
        return self.profile.cob_id is None and 0 < self.number <= PREDEFINED_PDOS

    @property
    def cob_id(self) -> int | None:
        """CAN-ID of RPDO n for an in-port, of TPDO n for an out-port.

        Without the node-ID if `relative`; None if none is named: the PDO is off.
        """
        if not self.relative:
            return self.profile.cob_id
        first = 0x200 if self.profile.direction is PortDirection.IN else 0x180
        return first + 0x100 * (self.number - 1)

    @property
    def subs(self) -> tuple[int, ...]:
        """Sub-indices of its elements: 0 of a variable, 1 and up of an array."""
        length = self.profile.port_type.length
        return (0,) if length == 1 else tuple(range(1, length + 1))

    @property
    def mapping(self) -> tuple[int, ...]:
        """What its PDO carries, as the mapping parameter says it.

        Booleans have a bit each (Table 4). Dummy bits fill up the last byte of an RPDO; a TPDO
        can have none (CiA 301), so its last byte ends with zeros that nothing is mapped to.
        """
        kind = self.profile.port_type
        mapped = [MappedObject(self.index, sub, kind.element_bits).encode() for sub in self.subs]
        gap = -kind.bits % 8 if self.profile.direction is PortDirection.IN else 0
        return (*mapped, *[_DUMMY_BIT] * gap)


@dataclass(frozen=True, slots=True, kw_only=True)
class RtcProfile:
    """What a component says of itself.

    Attributes:
        type_name: as a name of a port; 1008h.
        version: as 1.0 or 1.0.2; 100Ah, and the revision number 1018h:03.
        vendor: who made it, for the EDS.
        category: what it is, for people.
        rate_hz: how often `on_execute` runs, 1..1000 Hz.
        product_code: 1018h:02; unless given, the CRC-32 of the type name.
        ports: in order of declaration.

    Raises:
        ValueError: one line that says what came and what is allowed.
    """

    type_name: str
    version: str = "1.0"
    vendor: str = ""
    category: str = ""
    rate_hz: int = 100
    product_code: int = 0
    ports: tuple[CanopenPortProfile, ...] = ()

    def __post_init__(self) -> None:
        """Check all of it (DECISION K17)."""
        _check_name("type_name", self.type_name)
        if not _VERSION.fullmatch(self.version):
            raise ValueError(f"version {self.version!r} is not like 1.0 or 1.0.2")
        for what, text in (("vendor", self.vendor), ("category", self.category)):
            if not _fits_a_line(text):
                raise ValueError(f"{what} {text!r} is not one line of ASCII")
        if self.rate_hz not in RATE_HZ:
            raise ValueError(f"rate_hz {self.rate_hz} is not in 1..{RATE_HZ[-1]}")
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
        """Return the ports with their places; those with a PDO of one direction, or all."""
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
        if pdos > MOST_PDOS:
            raise ValueError(f"{pdos} {direction.value}-ports with a PDO, there are {MOST_PDOS}")
    if len(ports) > len(PORT_OBJECTS):
        raise ValueError(f"{len(ports)} ports, there are objects for {len(PORT_OBJECTS)}")
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
    if port.cob_id not in CAN_IDS or is_restricted(port.cob_id):
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
    """Say whether an EDS, C and YAML hold a text as it is."""
    return text.isascii() and text.isprintable() and text == text.strip() and ";" not in text
