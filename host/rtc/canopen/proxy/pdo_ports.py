"""Ports of a PDO (ours: K2, K3, K4)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tickrig.host.rtc.canopen.proxy.pdo_decoder import pdo_decoder
from tickrig.host.rtc.canopen.proxy.pdo_layout import PdoField, PdoLayout, sequence_of
from tickrig.host.rtc.ports.data_port import InPort, OutPort
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.rtc_types.basic import Time
from tickrig.wire.rtc_types.idl import Struct


class PortShape:
    """The ports of a PDO: one for all its objects, or one for each if their types differ.

    Args:
        layout: the PDO.
        name: of the port, or what those of single objects begin with.

    Attributes:
        names: of the ports.
        types: what each carries.
        single: whether one port has all objects as a sequence.
    """

    def __init__(self, layout: PdoLayout, name: str) -> None:
        fields = layout.fields
        kinds = {field.type.one for field in fields}
        many = fields[0].type.many if len(kinds) == 1 and len(fields) > 1 else None
        self.single = many is not None
        self.names: tuple[str, ...] = (name,)
        self.types: tuple[type[Struct], ...] = ()
        if many is not None:
            self.types = (many,)
        elif len(fields) == 1:
            self.types = (fields[0].type.one,)
        else:
            self.names = tuple(f"{name}_{_suffix(field)}" for field in fields)
            self.types = tuple(field.type.one for field in fields)


class PdoSource:
    """A TPDO of the device: each frame is written to its OutPorts.

    Attributes:
        layout: the PDO.
        size: bytes that a frame has at least.
        ports: the OutPorts.
    """

    def __init__(self, layout: PdoLayout, name: str) -> None:
        shape = PortShape(layout, name)
        self.layout, self.size, self._single = layout, layout.size, shape.single
        self._decode = pdo_decoder(layout)
        self.ports = tuple(
            OutPort[Any](port, kind) for port, kind in zip(shape.names, shape.types, strict=True)
        )

    def receive(self, now_us: int, data: bytes) -> None:
        """Write what a frame carries; its time stamp is that of reception."""
        tm, values = Time.from_us(now_us), self._decode(data)
        if self._single:
            (port,) = self.ports
            if port.connectors:
                port.write(sequence_of(port.data_type, tm, values))
            return
        for port, value in zip(self.ports, values, strict=True):
            if port.connectors:
                port.write(port.data_type(tm, value))


class PdoSink:
    """An RPDO of the device: each value that comes to an InPort is one frame.

    Where objects have ports of their own, the others are sent as they were last.

    Attributes:
        layout: the PDO.
        ports: the InPorts.
        linked: another device sends this PDO; nothing is sent from here.
    """

    def __init__(self, layout: PdoLayout, name: str) -> None:
        shape = PortShape(layout, name)
        self.layout, self._shape, self.linked = layout, shape, False
        self.ports = tuple(
            InPort[Any](port, kind) for port, kind in zip(shape.names, shape.types, strict=True)
        )
        self._latest: list[Value] = [field.type.decode(0) for field in layout.fields]

    def preset(self, index: int, value: Value) -> None:
        """Let an object without a new value be sent as this one."""
        for place, field in enumerate(self.layout.fields):
            if field.mapped.index == index:
                self._latest[place] = value

    def clear(self) -> None:
        """Drop what has not been sent."""
        for port in self.ports:
            port.clear()

    def take(self) -> Iterator[tuple[str, Struct]]:
        """Take all new values, each with the name of its port."""
        for port in self.ports:
            while port.is_new:
                value = port.read()
                assert isinstance(value, port.data_type)
                yield port.name, value

    def encode(self, port: str, value: Struct) -> bytes:
        """Return the data of the frame that a value makes; ValueError if it does not fit."""
        data: Any = getattr(value, "data", None)
        if not self._shape.single:
            latest = list(self._latest)
            latest[self._shape.names.index(port)] = data
        elif len(data) != len(self._latest):
            raise ValueError(f"{len(data)} values, {self.layout.name} has {len(self._latest)}")
        else:
            latest = list(data)
        encoded = self.layout.encode(tuple(latest))
        self._latest = latest
        return encoded


def _suffix(field: PdoField) -> str:
    return f"{field.mapped.index:04X}_{field.mapped.sub:02X}"
