"""Ports of somebody who looks at a running system: they show values, and put values in."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Any, Final

from tickrig.host.rtc.ports.connect import connect
from tickrig.host.rtc.ports.data_port import InPort, OutPort
from tickrig.host.rtc.ports.literal import read_literal
from tickrig.host.rtc.ports.port import AnyPort
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.manager import Manager
from tickrig.wire.rtc_types.idl import Struct

HELD: Final = 1_000
"""So many values of a port are held; of more the oldest are lost."""

LEASE_US: Final = 5_000_000
"""An OutPort whose values nobody asked for this long is watched no more."""


@dataclass(frozen=True, slots=True)
class NumberedValue:
    """A value that an OutPort wrote; numbers count from 1 on, for each time it is watched."""

    number: int
    value: Struct


@dataclass(slots=True)
class _WatchedPort:
    """An InPort that takes what an OutPort writes."""

    port: InPort[Any]
    requested_us: int
    count: int = 0
    seen: deque[NumberedValue] = field(default_factory=lambda: deque(maxlen=HELD))

    def take(self) -> None:
        while self.port.is_new and (value := self.port.read()) is not None:
            self.count += 1
            self.seen.append(NumberedValue(self.count, value))


class Probes:
    """Watches OutPorts and injects into InPorts, each by a connector of its own.

    The connectors belong to no component, so they are not in a saved system.
    One that injects ends when what it carries was read.

    Args:
        manager: whose ports.
    """

    def __init__(self, manager: Manager) -> None:
        self._manager = manager
        self._watches: dict[AnyPort, _WatchedPort] = {}
        self._injections: dict[AnyPort, OutPort[Any]] = {}

    def watch(self, name: str, since: int = 0) -> tuple[tuple[NumberedValue, ...], int]:
        """Watch an OutPort from the first call on, and return what it wrote.

        Args:
            name: of the port, as `Manager.port` takes it.
            since: number of the last value that is known.

        Returns:
            The values after that, 1000 at most, and the number of the latest.

        Raises:
            RtcRefused: no such port, or no OutPort.
        """
        port = self._manager.port(name)
        if not isinstance(port, OutPort):
            raise RtcRefused(f"{name} is a {port.port_type}; values are shown of a DataOutPort")
        watch = self._watches.get(port) or self._start(port)
        watch.requested_us = self._manager.now_us
        watch.take()
        return tuple(seen for seen in watch.seen if seen.number > since), watch.count

    def inject(self, name: str, given: object) -> Struct:
        """Write a value to an InPort, as a connected OutPort would, and return it.

        Args:
            name: of the port, as `Manager.port` takes it.
            given: as JSON has it; see `literal`.

        Raises:
            RtcRefused: no such port, no InPort, or a value that does not fit.
        """
        port = self._manager.port(name)
        if not isinstance(port, InPort):
            raise RtcRefused(f"{name} is a {port.port_type}; values go into a DataInPort")
        value: Struct = read_literal(port.data_type, given, self._manager.now_us)
        if port not in self._injections:
            self._injections[port] = source = OutPort("inject", port.data_type)
            connect(source, port)
        self._injections[port].write(value)
        return value

    def tick(self, now_us: int) -> None:
        """Take what was written, and end what is not needed any more."""
        for port, watch in tuple(self._watches.items()):
            watch.take()
            if now_us - watch.requested_us > LEASE_US or not watch.port.connectors:
                watch.port.disconnect_all()
                del self._watches[port]
        for port, source in tuple(self._injections.items()):
            if not any(connector.buffer.readable for connector in source.connectors):
                source.disconnect_all()
                del self._injections[port]

    def _start(self, port: OutPort[Any]) -> _WatchedPort:
        watch = _WatchedPort(InPort("print", port.data_type), self._manager.now_us)
        connect(port, watch.port, {"dataport.buffer.length": str(HELD)})
        self._watches[port] = watch
        return watch
