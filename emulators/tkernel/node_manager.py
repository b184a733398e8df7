"""The manager of a node on T-Kernel, which refuses and reports requests beyond its limits."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, NoReturn, Protocol

from tickrig.host.links.link import Link
from tickrig.host.rtc.component import ExecutionContext, RtComponent
from tickrig.host.rtc.motion.options.lrf_capture_urg import LrfCaptureUrg
from tickrig.host.rtc.ports.connect import Properties
from tickrig.host.rtc.ports.port import AnyPort, ConnectorBase, ConnectorProfile
from tickrig.host.rtc.states import ReturnCode, RtcRefused
from tickrig.host.rtc.system.manager import Manager, R
from tickrig.host.rtc.ucode.cache import OpenSource, Source
from tickrig.host.rtc.ucode.contents_interpretation import ContentsInterpretation
from tickrig.host.rtc.ucode.infrared_rays_reader import InfraredRaysReader
from tickrig.host.rtc.ucode.ucode_settlement import UcodeSettlement
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types.cdr import encode

# Limits of a node on T-Kernel. The report has no numbers; these are choices.


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeLimits:
    """The limits of an emulated board that runs RT components.

    Attributes:
        connectors: largest number of connectors for all ports together, 1..1000.
        message_octets: largest size of a value as CDR, in bytes, 16..1048576.
        tick_us: period of the cyclic handlers in microseconds, 1000..1000000. All periods are
            multiples of it.
        boot_us: time from power-up until the board answers, in microseconds, 0..600000000.

    Raises:
        ValueError: a limit is out of range.
    """

    connectors: int = 8
    message_octets: int = 4_096
    tick_us: int = 10_000
    boot_us: int = 3_000_000

    def __post_init__(self) -> None:
        """Raise ValueError if a value is out of range."""
        ranges = {
            "connectors": (1, 1_000),
            "message_octets": (16, 1 << 20),
            "tick_us": (1_000, 1_000_000),
            "boot_us": (0, 600_000_000),
        }
        for name, (low, high) in ranges.items():
            if not low <= getattr(self, name) <= high:
                raise ValueError(f"{name} {getattr(self, name)} is not in {low}..{high}")


# Theory of operation
# ===================
#
# The limits are checked in four methods, so it makes no difference whether a request comes from
# the command line, a control socket or a peer:
#
# - `add`: the period of a component;
# - `allows_period` of its contexts: a rate that is set later;
# - `admit`: each new connector;
# - `passes`: each value that a component writes or that comes from a peer.
#
# The ports call `admit` and `passes`. They get the manager as their `guard` before any other
# object can reach their component.
#
# - A connector between two components of the node is at two ports and counts once. Connectors of
#   observers do not count, because they are on no board.
# - A refusal is counted under one of `REFUSED`. The board has an output `refused_NAME` for each,
#   which keeps counting over boots. A new reason needs its name in `REFUSED`.
# - A refusal raises an exception for the caller. A value that is too long is an exception to this
#   rule: its writer gets PORT_ERROR, or INVALID_ARGS if the writer is a peer.
# - `passes` may be called in the threads of peers, so it has the lock. All other methods run in
#   the thread of the manager.

HOST: Final = "tkernel"
"""Naming context of the node."""

_RATE_HZ: Final = 100.0
"""Default rate of components, which is the highest rate."""

_INTERFACE: Final = "dataport.interface_type"
_CORBA_CDR: Final = "corba_cdr"
_NEWER: Final = frozenset({"dataport.buffer.read.policy", "dataport.buffer.read.skip_count"})
"""Properties of connectors that OpenRTM 1.0 does not have."""

_MOST_LOGGED: Final = 100

_LOG: Final = log_of(__name__)


class NodeManager(Manager):
    """Runs RT components within the limits of a small board (NEDO report 3.4.43.3 (4)).

    The interfaces are those of OpenRTM 1.0: data are always passed as CDR, never directly
    (`direct`), and connectors do not have the properties of later versions. As in RtORB, requests
    are served one after the other. The manager's thread serves the requests of peers; one lock
    covers the values that peers write. Refusals are counted, and the first refusal of each reason
    and port is logged.

    Not limited: memory, processor time, threads, and the connectors of observers such as
    `tickrig rtc print`, which are on no board.

    Args:
        limits: the limits of the node.

    Attributes:
        limits: the limits of the node.
        refused: number of refusals, by `REFUSED`.
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
        rate_hz: float = _RATE_HZ,
        context: ExecutionContext | None = None,
    ) -> RtComponent:
        """Create a component, by default with a rate of 100 Hz; see `Manager.create`."""
        return super().create(type_name, instance_name, rate_hz, context)

    def add(
        self, component: R, rate_hz: float = _RATE_HZ, context: ExecutionContext | None = None
    ) -> R:
        """Add an RT component to the board if the board's limits allow it; see `Manager.add`.

        Raises:
            RtcRefused: the period of the component is not a multiple of the board's tick, or
                `Manager.add` refuses the component.
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
        """Connect two ports, by default by CDR; see `Manager.connect`."""
        stated = {_INTERFACE: _CORBA_CDR, **(properties or {})}
        return super().connect(first, second, stated, name=name, connector_id=connector_id)

    def admit(self, connector: ConnectorBase, /) -> None:
        """Raise RtcRefused unless the ports of a connector may have this additional connector."""
        if len(connector.ports) == 2 and not connector.joins_components:
            return  # an observer's
        way, properties = " to ".join(connector.profile.ports), connector.profile.properties
        if len(connector.ports) == 2:  # those of peers are encoded whatever they say
            self._check_interface(way, properties.get(_INTERFACE, _CORBA_CDR))
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
        if interface != _CORBA_CDR:
            why = f"{_INTERFACE} {interface} is not of OpenRTM 1.0: {_CORBA_CDR} is"
            self._refuse("interfaces", way, why, ReturnCode.UNSUPPORTED)

    def _check_level(self, way: str, properties: Mapping[str, str]) -> None:
        if newer := sorted(_NEWER.intersection(properties)):
            why = f"{newer[0]} is not of OpenRTM 1.0"
            self._refuse("interfaces", way, why, ReturnCode.UNSUPPORTED)

    def _connectors(self) -> set[ConnectorBase]:
        """Return all connectors except those of observers."""
        return {
            connector
            for component in self.components
            for port in component.ports.values()
            for connector in port.connectors
            if len(connector.ports) == 1 or connector.joins_components
        }

    def _refused_period(self, name: str, period_us: int) -> str:
        """Return the reason to refuse a period, or "" if the period is allowed."""
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
        if (what, who) not in self._logged and len(self._logged) < _MOST_LOGGED:
            self._logged.add((what, who))
            _LOG.warning("refused, a limit of the node: %s: %s", who, why)


# The applications of the report's node: range finder (Fig. 122), position detection (Fig. 123).

_RANGE_FINDER: Final = "LRFCapture_URG0"
READER: Final = "InfraredRaysReader0"
SETTLEMENT: Final = "UcodeSettlement0"
CONTENTS: Final = "ContentsInterpretation0"

_OpenLine = Callable[[str], Link[bytes]]


class _Closable(Protocol):
    def close(self) -> None: ...


class BoardLines:
    """Opens the lines from an emulated board to its devices, for the RT components of the board.

    When the board loses its supply, this object cuts all lines that it has opened.

    Args:
        open_urg: function that opens the line of a range finder.
        open_reader: function that opens the line of a ucode reader.
        open_source: function that makes the client of the ucode resolution service.
    """

    def __init__(
        self, open_urg: _OpenLine, open_reader: _OpenLine, open_source: OpenSource
    ) -> None:
        self._open_urg, self._open_reader, self._open_source = open_urg, open_reader, open_source
        self._opened: list[_Closable] = []

    def open_urg(self, name: str) -> Link[bytes]:
        """Open the line of a range finder."""
        self._opened.append(link := self._open_urg(name))
        return link

    def open_reader(self, name: str) -> Link[bytes]:
        """Open the line of a ucode reader."""
        self._opened.append(link := self._open_reader(name))
        return link

    def open_source(self, name: str, hosts: tuple[str, ...]) -> Source:
        """Make the client of the resolution service."""
        self._opened.append(source := self._open_source(name, hosts))
        return source

    def cut(self) -> None:
        """Close everything without notice to any device."""
        for opened in self._opened:
            opened.close()
        self._opened.clear()


def add_range_finder(manager: NodeManager, lines: BoardLines, device: str) -> None:
    """Add and activate the component of a range finder at a line."""
    component = manager.add(LrfCaptureUrg(_RANGE_FINDER, lines.open_urg))
    component.configuration.set("DeviceFileName", device)
    manager.activate(_RANGE_FINDER)


def add_position_detection(
    manager: NodeManager, lines: BoardLines, device: str, service: str = ""
) -> None:
    """Add to a board the RT components that detect a position by ucodes, and activate them.

    These are three components: `InfraredRaysReader` receives ucodes, `UcodeSettlement` asks for the
    address of the information about a ucode, and `ContentsInterpretation` fetches this information.
    They are connected with each other before they are activated.

    Args:
        manager: the manager of the board's RT components.
        lines: object that opens the lines of the components.
        device: name of the reader's line.
        service: address of the resolution service. The default is the address in the component.
    """
    reader = manager.add(InfraredRaysReader(READER, lines.open_reader))
    reader.configuration.set("DeviceFileName", device)
    settlement = manager.add(UcodeSettlement(SETTLEMENT, lines.open_source))
    if service:
        settlement.configuration.set("service", service)
    manager.add(ContentsInterpretation(CONTENTS, lines.open_source))
    manager.connect(f"{READER}.ucodes", f"{SETTLEMENT}.ucodes")
    manager.connect(f"{SETTLEMENT}.addresses", f"{CONTENTS}.addresses")
    manager.activate(READER, SETTLEMENT, CONTENTS)
