"""A PDO of a device as its proxy has it (NEDO report, Fig. 109)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from tickrig.host.rtc_canopen.definition.device_file import TPDOS
from tickrig.host.rtc_canopen.proxy.port_types import PORT_TYPES, PortType
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.pdo import MappedObject

PAIR = 0x400
"""The proxy of a TPDO is an RPDO 400h below, that of an RPDO a TPDO 400h above."""

PARAMETERS = 0x200
"""From a communication parameter to its mapping parameter."""


def proxy_index(index: int) -> int:
    """Return the index that an object of a device's PDO has in its proxy.

    >>> f"{proxy_index(0x1801):04X}h {proxy_index(0x1A01):04X}h {proxy_index(0x1400):04X}h"
    '1401h 1601h 1800h'
    """
    return index - PAIR if index >= TPDOS.start else index + PAIR


@dataclass(frozen=True, slots=True)
class PdoField:
    """A mapped object.

    Attributes:
        shift: bits before it in the PDO.
        type: how it is seen at a port.
    """

    mapped: MappedObject
    shift: int
    type: PortType


@dataclass(frozen=True)
class PdoLayout:
    """What a PDO carries.

    Attributes:
        index: communication parameter in the device.
        cob_id: CAN-ID.
        fields: the mapped objects, without dummies.
        bits: length of the PDO.
        unknown: mapped objects of a type that no port has; no ports are made then.
    """

    index: int
    cob_id: int
    fields: tuple[PdoField, ...]
    bits: int
    unknown: tuple[MappedObject, ...] = field(default=())

    @property
    def name(self) -> str:
        """What a System Definition calls it: `tpdo1`."""
        kind = "t" if self.sends else "r"
        return f"{kind}pdo{(self.index & 0x1FF) + 1}"

    @property
    def sends(self) -> bool:
        """Whether the device sends it."""
        return self.index in TPDOS

    @property
    def size(self) -> int:
        """Bytes in a frame."""
        return (self.bits + 7) // 8

    def decode(self, data: bytes) -> tuple[Value, ...]:
        """Return the values in a frame of at least `size` bytes."""
        number = int.from_bytes(data, "little")
        return tuple(
            field.type.decode(number >> field.shift & (1 << field.type.bits) - 1)
            for field in self.fields
        )

    def encode(self, values: tuple[Value, ...]) -> bytes:
        """Return the data of a frame; ValueError if a value does not fit."""
        number = 0
        for item, value in zip(self.fields, values, strict=True):
            number |= item.type.encode(value) << item.shift
        return number.to_bytes(self.size, "little")


def lay_out(
    index: int,
    cob_id: int,
    mapping: tuple[MappedObject, ...],
    data_types: Mapping[tuple[int, int], int],
) -> PdoLayout:
    """Lay a PDO out by its mapping; objects below 20h are dummies, which nobody sees."""
    fields, unknown, shift = list[PdoField](), list[MappedObject](), 0
    for mapped in mapping:
        data_type = data_types.get((mapped.index, mapped.sub), 0)
        if (kind := PORT_TYPES.get((data_type, mapped.bits))) is not None:
            fields.append(PdoField(mapped, shift, kind))
        elif mapped.index >= 0x20:
            unknown.append(mapped)
        shift += mapped.bits
    real = tuple(item for item in fields if item.mapped.index >= 0x20)
    return PdoLayout(index, cob_id, real, shift, tuple(unknown))
