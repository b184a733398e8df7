"""The manager of a node on T-Kernel: what is beyond its limits is refused, and told."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Mapping
from typing import Any, Final, NoReturn

from tickrig.emulators.tkernel.node.limits import NodeLimits
from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.execution.execution_context import ExecutionContext
from tickrig.host.rtc.ports.connect import Properties
from tickrig.host.rtc.ports.port import AnyPort, ConnectorBase, ConnectorProfile
from tickrig.host.rtc.states import ReturnCode, RtcRefused
from tickrig.host.rtc.system.manager import Manager, R
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types.cdr import encode

HOST: Final = "tkernel"
"""Its naming context."""

RATE_HZ: Final = 100.0
"""Of components for which nobody names one: the shortest period."""

INTERFACE: Final = "dataport.interface_type"
CORBA_CDR: Final = "corba_cdr"
NEWER: Final = frozenset({"dataport.buffer.read.policy", "dataport.buffer.read.skip_count"})
"""Properties of connectors that OpenRTM 1.0 does not have."""

MOST_LOGGED: Final = 100
REFUSED: Final = ("connectors", "interfaces", "messages", "periods")

_LOG: Final = log_of(__name__)


class NodeManager(Manager):
    """Runs RT components within the limits of a small board (NEDO report 3.4.43.3 (4)).

    Interfaces are those of OpenRTM 1.0: data passes as CDR, never as it is (`direct`), and
    connectors have no properties that came later. Requests are served one after the other, as
    RtORB does: those of peers in the manager's thread, values of peers under one lock. What is
    refused is counted, and logged in a line, the first of each reason and port.

    Not limited: memory, processor time, threads, and the connectors of observers such as
    `tickrig rtc print`, which are on no board.

    Args:
        limits: of the node.

    Attributes:
        limits: as above.
        refused: how often what was refused, by `REFUSED`.
    """

    def __init__(self, limits: NodeLimits | None = None) -> None:
        super().__init__(HOST)
        self.limits = limits or NodeLimits()
        self.refused = Counter[str]()
        self._lock, self._logged = threading.Lock(), set[tuple[str, str]]()

    def create(
        self,
        type_name: str,
        instance_name: str = "",
        rate_hz: float = RATE_HZ,
        context: ExecutionContext | None = None,
    ) -> RtComponent:
        """Create a component, at 100 Hz if nobody says otherwise; see `Manager.create`."""
        return super().create(type_name, instance_name, rate_hz, context)

    def add(
        self, component: R, rate_hz: float = RATE_HZ, context: ExecutionContext | None = None
    ) -> R:
        """Add a component, and keep it within the limits; see `Manager.add`.

        Raises:
            RtcRefused: its period is no multiple of the node's tick, and what `Manager.add`
                refuses.
        """
        name = component.instance_name
        wanted = ExecutionContext(rate_hz) if context is None else context
        if why := self._refused_period(name, wanted.period_us):
            raise RtcRefused(why, ReturnCode.BAD_PARAMETER)
        for port in component.ports.values():
            port.guard = self
        added = super().add(component, rate_hz, context)
        for own in component.contexts:
            own.allows_period = lambda period_us: not self._refused_period(name, period_us)
        return added

    def connect(
        self,
        first: str,
        second: str,
        properties: Properties | None = None,
        *,
        name: str = "",
        connector_id: str = "",
    ) -> ConnectorProfile:
        """Join two ports, by CDR if nobody says otherwise; see `Manager.connect`."""
        stated = {INTERFACE: CORBA_CDR, **(properties or {})}
        return super().connect(first, second, stated, name=name, connector_id=connector_id)

    def admit(self, connector: ConnectorBase, /) -> None:
        """Raise RtcRefused unless its ports may have one more connector, this one."""
        if len(connector.ports) == 2 and not connector.joins_components:
            return  # an observer's
        way, properties = " to ".join(connector.profile.ports), connector.profile.properties
        if len(connector.ports) == 2:  # those of peers are encoded whatever they say
            self._check_interface(way, properties.get(INTERFACE, CORBA_CDR))
        self._check_level(way, properties)
        if (count := len(self._connectors())) >= self.limits.connectors:
            why = f"{count} connectors are all that this node has"
            self._refuse("connectors", way, why, ReturnCode.OUT_OF_RESOURCES)

    def passes(self, port: AnyPort, value: Any, /) -> bool:
        """Return whether a value is short enough."""
        with self._lock:
            try:
                size = len(encode(value))
            except ValueError:
                return True  # no value at all: its connector says so
            if size <= self.limits.message_octets:
                return True
            most = self.limits.message_octets
            self._note("messages", port.full_name, f"{size} octets are more than {most} a message")
            return False

    def _check_interface(self, way: str, interface: str) -> None:
        if interface != CORBA_CDR:
            why = f"{INTERFACE} {interface} is not of OpenRTM 1.0: {CORBA_CDR} is"
            self._refuse("interfaces", way, why, ReturnCode.UNSUPPORTED)

    def _check_level(self, way: str, properties: Mapping[str, str]) -> None:
        if newer := sorted(NEWER.intersection(properties)):
            why = f"{newer[0]} is not of OpenRTM 1.0"
            self._refuse("interfaces", way, why, ReturnCode.UNSUPPORTED)

    def _connectors(self) -> set[ConnectorBase]:
        """Return all but those of observers."""
        return {
            connector
            for component in self.components
            for port in component.ports.values()
            for connector in port.connectors
            if len(connector.ports) == 1 or connector.joins_components
        }

    def _refused_period(self, name: str, period_us: int) -> str:
        """Return why a period cannot be, empty if it can."""
        tick_us = self.limits.tick_us
        if not period_us % tick_us:
            return ""
        why = (
            f"its period of {period_us / 1_000:g} ms is no multiple of the cyclic handler's"
            f" {tick_us / 1_000:g} ms"
        )
        self._note("periods", name, why)
        return f"{name}: {why}"

    def _refuse(self, what: str, who: str, why: str, code: ReturnCode) -> NoReturn:
        self._note(what, who, why)
        raise RtcRefused(f"{who}: {why}", code)

    def _note(self, what: str, who: str, why: str) -> None:
        self.refused[what] += 1
        if (what, who) not in self._logged and len(self._logged) < MOST_LOGGED:
            self._logged.add((what, who))
            _LOG.warning("refused, a limit of the node: %s: %s", who, why)
