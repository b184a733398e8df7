"""Ports that SDO carries: texts, and what is wider than a PDO (ours: K5)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeVar

from tickrig.host.canopen.dialogue import Script
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.host.rtc.canopen.definition.definition import NodeEntry, SdoPortEntry
from tickrig.host.rtc.canopen.proxy.pdo_layout import PORT_KINDS, sequence_of
from tickrig.host.rtc.ports.data_port import InPort, OutPort
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.rtc_canopen.port_types import WIDE_CHARACTER, CanopenPortType
from tickrig.wire.rtc_canopen.profile import MOST_ELEMENTS, PortDirection, PortTransport
from tickrig.wire.rtc_types.basic import Time
from tickrig.wire.rtc_types.idl import Struct

T = TypeVar("T", bound=Struct)

TRANSPORT: Final = {"transport": PortTransport.SDO.value}
"""What the profile of such a port says beside what all ports say."""


class _SdoOutPort(OutPort[T]):
    """An OutPort that says in its profile what carries it."""

    def _properties(self) -> Mapping[str, str]:
        return {**super()._properties(), **TRANSPORT}


class _SdoInPort(InPort[T]):
    """An InPort that says in its profile what carries it."""

    def _properties(self) -> Mapping[str, str]:
        return {**super()._properties(), **TRANSPORT}


@dataclass(frozen=True, slots=True)
class SdoPortLayout:
    """The objects of a port.

    Attributes:
        name: of the port.
        direction: `out` gives what is read, `in` writes.
        index: of the object.
        subs: sub-indices of the elements.
        kind: type of the value, as Table 4 has it.
        struct: what the port carries.
    """

    name: str
    direction: PortDirection
    index: int
    subs: tuple[int, ...]
    kind: CanopenPortType[Any]
    struct: type[Struct]

    def read(self) -> Script[tuple[bytes, ...]]:
        """Read all elements in their order; raises as `upload`."""
        elements = []
        for sub in self.subs:
            elements.append((yield from upload(self.index, sub, self.kind.data_type.size)))
        return tuple(elements)

    def decode(self, tm: Time, elements: Sequence[bytes]) -> Struct:
        """Return the value of the bytes of all elements; FieldError if they are none."""
        value: Any = self.kind.decode(elements)
        if not self.kind.element_bits:  # a string ends before the first 0, in C and in CORBA
            value = tuple(map(_text, value)) if self.kind.many else _text(value)
        kind: Any = self.struct
        return sequence_of(kind, tm, value) if self.kind.many else kind(tm, value)

    def write(self, elements: Sequence[bytes]) -> Script[None]:
        """Write all elements in their order; raises as `download`."""
        for sub, data in zip(self.subs, elements, strict=True):
            yield from download(self.index, sub, data)

    def encode(self, value: Struct) -> tuple[bytes, ...]:
        """Return the bytes of each element; ValueError or TypeError if the value does not fit."""
        data: Any = getattr(value, "data", None)
        return self.kind.encode(tuple(data) if self.kind.many else data)


class SdoSource:
    """An object of the device that an OutPort gives.

    Attributes:
        layout: the object.
        port: the OutPort.
    """

    def __init__(self, layout: SdoPortLayout) -> None:
        self.layout, self.port = layout, _SdoOutPort[Any](layout.name, layout.struct)


class SdoSink:
    """An object of the device that takes what comes to an InPort; only the newest counts.

    Attributes:
        layout: the object.
        port: the InPort.
        pending: bytes that are to be written, None for nothing.
    """

    def __init__(self, layout: SdoPortLayout) -> None:
        self.layout, self.port = layout, _SdoInPort[Any](layout.name, layout.struct)
        self.pending: tuple[bytes, ...] | None = None

    def take(self) -> Struct | None:
        """Take the newest value; None without a new one."""
        value = None
        while self.port.is_new:
            value = self.port.read()
        return value

    def clear(self) -> None:
        """Drop what has not been written."""
        self.port.clear()
        self.pending = None


def lay_out_sdo_ports(
    entry: NodeEntry, data_types: Mapping[tuple[int, int], int]
) -> tuple[tuple[SdoPortLayout, ...], tuple[str, ...]]:
    """Return the ports that a node is given, and why others cannot be.

    Args:
        entry: the node.
        data_types: of its EDS, by index and sub-index.
    """
    made, refused = list[SdoPortLayout](), list[str]()
    for name, port in entry.sdo_ports.items():
        try:
            made.append(_lay_out(name, port, data_types))
        except ValueError as error:
            refused.append(f"{name}: {error}")
    return tuple(made), tuple(refused)


def _lay_out(
    name: str, port: SdoPortEntry, data_types: Mapping[tuple[int, int], int]
) -> SdoPortLayout:
    subs: tuple[int, ...] = (0,)
    if (port.index, 1) in data_types:
        subs = tuple(sub for sub in range(1, MOST_ELEMENTS + 1) if (port.index, sub) in data_types)
    found = {data_types.get((port.index, sub)) for sub in subs}
    if found == {None}:
        raise ValueError(f"the EDS has no object {port.index:04X}h")
    data_type = found.pop()
    if found or data_type is None:
        raise ValueError(f"the elements of {port.index:04X}h have several data types")
    for row, one, many in PORT_KINDS:
        if row.data_type == data_type and (port.type or _usual(row)) == row.name:
            if len(subs) == 1 and subs == (0,):
                return SdoPortLayout(name, port.direction, port.index, subs, row, one)
            kind = row.sequence(len(subs))
            return SdoPortLayout(name, port.direction, port.index, subs, kind, many)
    wanted = port.type or "any type of a port"
    raise ValueError(f"{port.index:04X}h is {DataType(data_type).name} in the EDS, not {wanted}")


def _usual(row: CanopenPortType[Any]) -> str:
    """Return the name of a row that counts without `type`: a Unicode string is a text."""
    return "" if row is WIDE_CHARACTER else row.name


def _text(value: str) -> str:
    return value.partition("\0")[0]
