"""The communication objects that all our models have (CiA 301, 1000h to 1FFFh)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import (
    CONST,
    RO,
    ROT,
    RW,
    Element,
    ObjectCode,
    ObjectTable,
)

U8: Final = DataType.UNSIGNED8
U16: Final = DataType.UNSIGNED16
U32: Final = DataType.UNSIGNED32
TEXT: Final = DataType.VISIBLE_STRING

OFF: Final = 0x8000_0000
ERRORS_KEPT: Final = 8
CONSUMERS: Final = 4
MAPPED: Final = 8
"""Entries that a mapping record holds."""


@dataclass(frozen=True, slots=True)
class Pdo:
    """A PDO as it is at power-on.

    Attributes:
        cob_id: without the node-ID, with bit 31 if it is off.
        mapping: objects as 6040 0010h: index, sub-index, bits.
        transmission_type: 0..255.
        inhibit_100us: inhibit time of a TPDO.
        event_ms: event timer.
        relative: the node-ID is added to the COB-ID.
    """

    cob_id: int
    mapping: tuple[int, ...] = ()
    transmission_type: int = 255
    inhibit_100us: int = 0
    event_ms: int = 0
    relative: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class CommunicationProfile:
    """What differs from device to device.

    Attributes:
        device_type: 1000h.
        name: 1008h.
        hardware: 1009h.
        software: 100Ah.
        product_code: 1018h:02; the vendor-ID is 0, which is nobody's.
        rpdos: from 1400h on.
        tpdos: from 1800h on.
        revision: 1018h:03.
        heartbeat_ms: 1017h.
    """

    device_type: int
    name: str
    hardware: str
    software: str
    product_code: int
    rpdos: Sequence[Pdo]
    tpdos: Sequence[Pdo]
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
    objects.variable(0x1008, "Manufacturer device name", TEXT, CONST, profile.name)
    objects.variable(0x1009, "Manufacturer hardware version", TEXT, CONST, profile.hardware)
    objects.variable(0x100A, "Manufacturer software version", TEXT, CONST, profile.software)
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
    rows = [Element(sub, f"Error {sub}", U32, RO) for sub in range(1, ERRORS_KEPT + 1)]
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
    objects.array(0x1016, "Consumer heartbeat time", CONSUMERS, U32, RW)
    objects.variable(0x1017, "Producer heartbeat time", U16, RW, profile.heartbeat_ms)
    rows = [
        Element(1, "COB-ID client to server", U32, RO, 0x600, relative=True),
        Element(2, "COB-ID server to client", U32, RO, 0x580, relative=True),
    ]
    objects.record(0x1200, "SDO server parameter", rows)


def _add_pdo(objects: ObjectTable, kind: str, index: int, pdo: Pdo, timing: list[Element]) -> None:
    number = index % 0x200 + 1
    head = [
        Element(1, "COB-ID", U32, RW, pdo.cob_id, relative=pdo.relative),
        Element(2, "Transmission type", U8, RW, pdo.transmission_type),
    ]
    objects.record(index, f"{kind}{number} communication parameter", [*head, *timing])
    mapped = [*pdo.mapping, *[0] * (MAPPED - len(pdo.mapping))]
    rows = [Element(sub, f"Object {sub}", U32, RW, value) for sub, value in enumerate(mapped, 1)]
    title = f"{kind}{number} mapping parameter"
    objects.record(index + 0x200, title, rows, count_access=RW, count=len(pdo.mapping))


def _rpdo_timing(pdo: Pdo) -> list[Element]:
    return [Element(5, "Event timer", U16, RW, pdo.event_ms)]


def _tpdo_timing(pdo: Pdo) -> list[Element]:
    return [
        Element(3, "Inhibit time", U16, RW, pdo.inhibit_100us),
        Element(5, "Event timer", U16, RW, pdo.event_ms),
        Element(6, "SYNC start value", U8, RW),
    ]
