"""Ports of a proxy, made from the profile of its device, and what passes through (DECISION L10).

The time of a value is not on the wire: it is stamped when it arrives.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Any, Final

from tickrig.host.links.errors import DeviceRefused
from tickrig.host.rtc.ports.data_port import InPort, OutPort
from tickrig.host.rtc.ports.port import AnyPort
from tickrig.host.text.log import log_of
from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_lite.messages import LitePortData, LitePortProfile
from tickrig.wire.rtc_lite.values import PORT_TYPES, LitePortType
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
class InPortBridge:
    """An InPort of the proxy, and the in-port of the device behind it."""

    port: InPort[Any]
    name: bytes
    port_type: LitePortType[Any]

    @classmethod
    def of(cls, profile: LitePortProfile) -> InPortBridge:
        """Make the InPort of an in-port; DeviceRefused if its type is not known."""
        name, port_type = _read(profile)
        return cls(InPort(name, _KINDS[port_type.name]), profile.name, port_type)

    def take(self) -> LitePortData | None:
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
        return LitePortData(self.name, self.port_type.encode(bare))


@dataclass(frozen=True, slots=True)
class OutPortBridge:
    """An OutPort of the proxy, and the out-port of the device behind it."""

    port: OutPort[Any]
    port_type: LitePortType[Any]

    @classmethod
    def of(cls, profile: LitePortProfile) -> OutPortBridge:
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


def _read(profile: LitePortProfile) -> tuple[str, LitePortType[Any]]:
    name = profile.name.decode("latin-1")
    if (port_type := PORT_TYPES.get(profile.code)) is None:
        known = " ".join(PORT_TYPES)
        raise DeviceRefused(f"port {name!r} has type {profile.code!r}; known: {known}", "CZ")
    return name, port_type


_LOG: Final = log_of(__name__)


class PortBridges:
    """The ports of a proxy, made from the profile of its device.

    A value that does not fit the device, and data that fit no port, are logged
    and dropped: they are no reason to stop.

    Args:
        ins: the in-ports of the device.
        outs: its out-ports.

    Attributes:
        dropped: how many values were dropped.

    Raises:
        DeviceRefused: a port of a type that nobody knows.
    """

    def __init__(
        self, ins: Iterable[LitePortProfile] = (), outs: Iterable[LitePortProfile] = ()
    ) -> None:
        self._ins = [InPortBridge.of(profile) for profile in ins]
        self._outs = {profile.name: OutPortBridge.of(profile) for profile in outs}
        self.dropped = 0

    @property
    def ports(self) -> Iterator[AnyPort]:
        """The InPorts, then the OutPorts."""
        return chain((relay.port for relay in self._ins), (r.port for r in self._outs.values()))

    def fresh(self) -> Iterator[LitePortData]:
        """Take one new value from each InPort that has one."""
        for relay in self._ins:
            try:
                data = relay.take()
            except FieldError as error:
                self._drop(relay.port.full_name, error)
            else:
                if data is not None:
                    yield data

    def give(self, at_us: int, data: LitePortData) -> None:
        """Write to an OutPort what arrived from the device."""
        if (relay := self._outs.get(data.name)) is None:
            self._drop("an out-port that was not described", repr(data.name))
            return
        try:
            relay.give(data.data, at_us)
        except FieldError as error:
            self._drop(relay.port.full_name, error)

    def _drop(self, where: str, why: FieldError | str) -> None:
        self.dropped += 1
        _LOG.warning("dropped at %s: %s", where, why)
