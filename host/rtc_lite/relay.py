"""A port of a proxy, made from the profile of its device (DECISION L10).

The time of a value is not on the wire: it is stamped when it arrives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from tickrig.host.links.errors import DeviceRefused
from tickrig.host.rtc.ports.data_port import InPort, OutPort
from tickrig.wire.rtc_lite.messages import PortData, PortProfile
from tickrig.wire.rtc_lite.values import PORT_TYPES, PortType
from tickrig.wire.rtc_types import basic
from tickrig.wire.rtc_types.basic import Time

_KINDS: Final[dict[str, type[Any]]] = {
    kind.__name__: kind
    for kind in (
        *(basic.TimedBoolean, basic.TimedChar, basic.TimedOctet, basic.TimedShort),
        *(basic.TimedLong, basic.TimedFloat, basic.TimedDouble),
        *(basic.TimedBooleanSeq, basic.TimedCharSeq, basic.TimedOctetSeq, basic.TimedShortSeq),
        *(basic.TimedLongSeq, basic.TimedFloatSeq, basic.TimedDoubleSeq),
    )
}


@dataclass(frozen=True, slots=True)
class InRelay:
    """An InPort of the proxy, and the in-port of the device behind it."""

    port: InPort[Any]
    name: bytes
    port_type: PortType[Any]

    @classmethod
    def of(cls, profile: PortProfile) -> InRelay:
        """Make the InPort of an in-port; DeviceRefused if its type is not known."""
        name, port_type = _read(profile)
        return cls(InPort(name, _KINDS[port_type.name]), profile.name, port_type)

    def take(self) -> PortData | None:
        """Return the oldest value that was not read, if there is one.

        Raises:
            FieldError: its type does not have it, or it does not fit into a frame.
        """
        value = self.port.read() if self.port.is_new else None
        if value is None:
            return None
        bare = value.data
        if self.port.data_type is basic.TimedOctetSeq:
            bare = tuple(bare)
        elif self.port.data_type is basic.TimedCharSeq:
            bare = "".join(bare)
        return PortData(self.name, self.port_type.encode(bare))


@dataclass(frozen=True, slots=True)
class OutRelay:
    """An OutPort of the proxy, and the out-port of the device behind it."""

    port: OutPort[Any]
    port_type: PortType[Any]

    @classmethod
    def of(cls, profile: PortProfile) -> OutRelay:
        """Make the OutPort of an out-port; DeviceRefused if its type is not known."""
        name, port_type = _read(profile)
        return cls(OutPort(name, _KINDS[port_type.name]), port_type)

    def give(self, data: bytes, now_us: int) -> None:
        """Write a value that arrived; FieldError if it is not of the port's type."""
        kind = self.port.data_type
        value = self.port_type.decode(data)
        if kind is basic.TimedOctetSeq:
            value = bytes(value)
        elif kind is basic.TimedCharSeq:
            value = tuple(value)
        self.port.write(kind(Time.from_us(now_us), value))


def _read(profile: PortProfile) -> tuple[str, PortType[Any]]:
    name = profile.name.decode("latin-1")
    if (port_type := PORT_TYPES.get(profile.code)) is None:
        known = " ".join(PORT_TYPES)
        raise DeviceRefused(f"port {name!r} has type {profile.code!r}; known: {known}", "CZ")
    return name, port_type
