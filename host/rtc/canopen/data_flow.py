"""Data between the bus and ports of proxies: by PDO, and by SDO."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial

from tickrig.host.canopen.dialogue import Failure, QueuedScript, Script
from tickrig.host.canopen.errors import SdoAborted
from tickrig.host.rtc.canopen import definition
from tickrig.host.rtc.canopen.events import Notify, ServerEventType
from tickrig.host.rtc.canopen.operations import kind_of, set_pdo
from tickrig.host.rtc.canopen.pdo_layout import PdoLayout
from tickrig.host.rtc.canopen.proxy import PdoSink, PdoSource, ProxyRtc, SdoSink, SdoSource
from tickrig.host.rtc.canopen.served_node import NodePhase, ServedNode
from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.ports.port import ConnectorProfile
from tickrig.host.rtc.states import ReturnCode, RtcRefused
from tickrig.host.rtc.system.manager import Manager
from tickrig.wire.can import CanFrame
from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.rtc import Time

_Send = Callable[[int, bytes], None]


class PdoDataFlow:
    """Writes received PDOs to OutPorts, and sends what comes to InPorts.

    Data pass while the proxy is Active; for the device not before it is Operational.

    Args:
        nodes: by node-ID.
        send: takes CAN-ID and data.
        notify: takes events.
    """

    def __init__(self, nodes: Mapping[int, ServedNode], send: _Send, notify: Notify) -> None:
        self._nodes, self._send, self._notify = nodes, send, notify
        self._sources: dict[int, tuple[tuple[ServedNode, PdoSource], ...]] = {}
        self._connected: tuple[tuple[ServedNode, PdoSink], ...] = ()
        self._written = set[int]()  # places in _connected: 126 sinks are not looked at each tick

    def route(self) -> None:
        """Collect anew which PDO goes to which OutPorts, and which InPorts have connectors."""
        self._sources = {}
        for node in self._nodes.values():
            for source in node.proxy.sources if node.proxy else ():
                cob_id = source.layout.cob_id
                self._sources[cob_id] = (*self._sources.get(cob_id, ()), (node, source))
        self._connected = tuple(
            (node, sink)
            for node, sink in self._sinks()
            if any(port.connectors for port in sink.ports)
        )
        self._written = set(range(len(self._connected)))
        for place, (_, sink) in enumerate(self._connected):
            for port in sink.ports:
                for connector in port.connectors:
                    connector.buffer.on_write = partial(self._written.add, place)

    def watch(self, node: ServedNode) -> None:
        """Collect anew whenever an InPort of a new proxy gets or loses a connector."""
        for sink in node.proxy.sinks if node.proxy else ():
            for port in sink.ports:
                port.on_connect.append(lambda _: self.route())
                port.on_disconnect.append(lambda _: self.route())
        self.route()

    def receive(self, now_us: int, frame: CanFrame) -> bool:
        """Take a frame; False if it is no PDO of a proxy."""
        routes = self._sources.get(frame.can_id, ())
        for node, source in routes:
            if len(frame.data) < source.size:
                text = f"{source.layout.name}: {len(frame.data)} of {source.size} bytes"
                self._notify(ServerEventType.PDO_TOO_SHORT, node.entry.id, text)
            elif node.proxy is not None and node.proxy.passing:
                source.receive(now_us, frame.data)
        return bool(routes)

    def send_values(self) -> None:
        """Send what came to InPorts; what cannot be sent now is dropped."""
        if not self._written:
            return
        connected, places = self._connected, sorted(self._written)
        self._written.clear()
        for node, sink in map(connected.__getitem__, places):
            for port, value in sink.take():
                if self._send_value(node, sink, port, value) is ReturnCode.BAD_PARAMETER:
                    text = f"{node.entry.name}.{port}: {value}"
                    self._notify(ServerEventType.VALUE_REFUSED, node.entry.id, text)

    def put(self, name: str, value: Struct) -> ReturnCode:
        """Send a value past all connectors; see `Server.put`."""
        for node, sink in self._sinks():
            for port in sink.ports:
                if port.full_name == name:
                    return self._send_value(node, sink, port.name, value)
        return ReturnCode.BAD_PARAMETER

    def _sinks(self) -> Iterator[tuple[ServedNode, PdoSink]]:
        for node in self._nodes.values():
            for sink in node.proxy.sinks if node.proxy else ():
                yield node, sink

    def _send_value(self, node: ServedNode, sink: PdoSink, port: str, value: Struct) -> ReturnCode:
        if node.proxy is None or not node.proxy.confirmed or sink.linked:
            return ReturnCode.PRECONDITION_NOT_MET
        try:
            data = sink.encode(port, value)
        except (ValueError, TypeError):
            return ReturnCode.BAD_PARAMETER
        self._send(sink.layout.cob_id, data)
        return ReturnCode.RTC_OK


class SdoDataFlow:
    """Reads objects for OutPorts, and writes what comes to InPorts, by SDO.

    While a proxy is Active and its device Operational, each port of it that has something to do
    is transferred once a period at most: all of them in one job, and the next job begins with the
    period after its end.

    Args:
        nodes: by node-ID.
        notify: takes events.
    """

    def __init__(self, nodes: Mapping[int, ServedNode], notify: Notify) -> None:
        self._nodes, self._notify = nodes, notify
        self._busy = set[int]()  # node-IDs
        self._failed = set[tuple[int, str]]()  # node-ID and port, of which was told

    def exchange(self, now_us: int) -> None:
        """Begin the transfers of a period."""
        for node_id, node in self._nodes.items():
            proxy = node.proxy
            if proxy is None or not (proxy.sdo_sources or proxy.sdo_sinks):
                continue
            if not proxy.passing:
                self._failed = {at for at in self._failed if at[0] != node_id}
            fit = proxy.confirmed and proxy.passing and node.phase is NodePhase.READY
            if not fit or node_id in self._busy:
                continue
            for sink in proxy.sdo_sinks:
                self._take(node, sink)
            sinks = [sink for sink in proxy.sdo_sinks if sink.pending is not None]
            sources = [source for source in proxy.sdo_sources if source.port.connectors]
            if sinks or sources:
                self._begin(now_us, node, self._transfer(node, proxy, sinks, sources))

    def put(self, name: str, value: Struct) -> ReturnCode | None:
        """Write a value past all connectors in the next period; None if there is no such port."""
        for node in self._nodes.values():
            for sink in node.proxy.sdo_sinks if node.proxy else ():
                if sink.port.full_name == name:
                    if node.proxy is None or not node.proxy.confirmed:
                        return ReturnCode.PRECONDITION_NOT_MET
                    return self._set(sink, value)
        return None

    def _take(self, node: ServedNode, sink: SdoSink) -> None:
        value = sink.take()
        if value is not None and self._set(sink, value) is ReturnCode.BAD_PARAMETER:
            text = f"{node.entry.name}.{sink.port.name}: {value}"
            self._notify(ServerEventType.VALUE_REFUSED, node.entry.id, text)

    def _set(self, sink: SdoSink, value: Struct) -> ReturnCode:
        try:
            sink.pending = sink.layout.encode(value)
        except (ValueError, TypeError):
            return ReturnCode.BAD_PARAMETER
        return ReturnCode.RTC_OK

    def _begin(self, now_us: int, node: ServedNode, script: Script[None]) -> None:
        node_id = node.entry.id

        def end(_: object = None) -> None:
            self._busy.discard(node_id)

        def fail(failure: Failure) -> None:
            end()
            self._report(node, kind_of(failure), "", str(failure))

        self._busy.add(node_id)
        node.run(now_us, QueuedScript("ports", script, end, fail, end, moves=False))

    def _transfer(
        self, node: ServedNode, proxy: ProxyRtc, sinks: list[SdoSink], sources: list[SdoSource]
    ) -> Script[None]:
        """Write, then read; what one port is refused does not hold up the others."""
        for sink in sinks:
            elements, sink.pending = sink.pending or (), None
            yield from self._try(node, sink, sink.layout.write(elements))
        for source in sources:
            yield from self._try(node, source, self._read(node, proxy, source))

    def _read(self, node: ServedNode, proxy: ProxyRtc, source: SdoSource) -> Script[None]:
        elements = yield from source.layout.read()
        value = source.layout.decode(Time.from_us(node.operations.now_us), elements)
        if proxy.passing:
            source.port.write(value)

    def _try(
        self, node: ServedNode, port: SdoSource | SdoSink, script: Script[None]
    ) -> Script[None]:
        """Run the transfer of a port; if it is refused, tell so once."""
        name = port.layout.name
        try:
            yield from script
        except SdoAborted as error:
            self._report(node, ServerEventType.SDO_ABORTED, name, str(error))
        except FieldError as error:
            self._report(node, ServerEventType.VALUE_REFUSED, name, str(error))
        else:
            self._failed.discard((node.entry.id, name))

    def _report(self, node: ServedNode, kind: ServerEventType, port: str, why: str) -> None:
        """Tell of a port that does not work, once until it works again."""
        at = node.entry.id, port
        if at not in self._failed:
            self._failed.add(at)
            name = f"{node.entry.name}.{port}" if port else node.entry.name
            self._notify(kind, node.entry.id, f"{name}: {why}")


# What joins nodes: connectors of ports through the PC, and PDO links without it (Fig. 120).


class PortConnections:
    """Makes connectors as soon as both ports are there; keeps those of a component that goes.

    Args:
        manager: has the ports.
        wanted: connectors to be made.
        notify: called with what became of each.

    Attributes:
        wanted: those that have not been made.
    """

    def __init__(
        self, manager: Manager, wanted: tuple[definition.RtConnection, ...], notify: Notify
    ) -> None:
        self._manager, self._notify = manager, notify
        self.wanted = list(wanted)
        self._refused = set[str]()

    @property
    def all(self) -> tuple[definition.RtConnection, ...]:
        """Those that are made, then those that are wanted."""
        made = (_entry(profile) for profile in self._manager.connectors)
        return (*made, *self.wanted)

    def make(self) -> None:
        """Make those whose ports are there; one that cannot be is wanted no more."""
        for entry in tuple(self.wanted):
            try:
                if not are_there(self._manager, entry):
                    continue
            except RtcRefused as error:
                self._refuse(str(error))
                continue
            self.wanted.remove(entry)
            self._connect(entry)

    def keep(self, component: RtComponent) -> None:
        """Want those of a component again that is about to go."""
        profiles = (
            connector.profile
            for port in component.ports.values()
            for connector in port.connectors
            if connector.joins_components
        )
        self.wanted += (_entry(profile) for profile in profiles)

    def forget(self, first: str, second: str) -> bool:
        """Want a connection no more; False if it is none that waits."""
        ends = {first, second}
        waiting = [entry for entry in self.wanted if {entry.source, entry.target} == ends]
        self.wanted = [entry for entry in self.wanted if entry not in waiting]
        return bool(waiting)

    def _refuse(self, text: str) -> None:
        """Tell once of a port that is not there; another boot of its device may bring it."""
        if text not in self._refused:
            self._refused.add(text)
            self._notify(ServerEventType.CONNECTION_REFUSED, 0, text)

    def _connect(self, entry: definition.RtConnection) -> None:
        ends = f"{entry.source} to {entry.target}"
        try:
            self._manager.connect(entry.source, entry.target, entry.properties)
        except RtcRefused as error:
            self._notify(ServerEventType.CONNECTION_REFUSED, 0, str(error))
        else:
            self._notify(ServerEventType.CONNECTED, 0, ends)


def are_there(manager: Manager, entry: definition.RtConnection) -> bool:
    """Say whether both components are there; RtcRefused if one that is has no such port."""
    names = {component.instance_name for component in manager.components}
    ends = [end for end in (entry.source, entry.target) if end.rpartition(".")[0] in names]
    for end in ends:
        manager.port(end)
    return len(ends) == 2


def _entry(profile: ConnectorProfile) -> definition.RtConnection:
    source, target = profile.ports
    return definition.RtConnection(source, target, dict(profile.properties))


class PdoLinks:
    """Makes PDO links when both nodes are ready: an RPDO receives the TPDO of another node.

    Args:
        nodes: by node-ID.
        links: those of the System Definition.
        notify: called with what became of each.

    Attributes:
        links: all that are wanted.
    """

    def __init__(
        self, nodes: Mapping[int, ServedNode], links: tuple[definition.PdoLink, ...], notify: Notify
    ) -> None:
        self._nodes, self._notify = nodes, notify
        self.links = list(links)
        self._made: dict[definition.PdoLink, int] = {}  # by which CAN-ID

    def add(self, now_us: int, link: definition.PdoLink) -> None:
        """Want a link, and make it; ServerRefused if it cannot be now."""
        for other in self.links:
            if other.target == link.target:
                raise definition.ServerRefused(f"{other.source} and {other.target} are linked")
        self._check(link)
        self.links.append(link)
        self._make(now_us, link)

    def remove(self, now_us: int, link: definition.PdoLink) -> None:
        """Give the RPDO its own COB-ID again; ServerRefused if there is no such link."""
        if link not in self.links:
            raise definition.ServerRefused(f"{link.source} and {link.target} are not linked")
        own = self.layout(link.target).cob_id
        self.links.remove(link)
        self._made.pop(link, None)
        self._write(now_us, link, own, linked=False)

    def make(self, now_us: int, node_id: int) -> None:
        """Make those of a node that has become ready; a target that stayed still has its own."""
        for link in self.links:
            if link.target.node == node_id:
                self._made.pop(link, None)
            ends = (link.source.node, link.target.node)
            if node_id in ends and all(self._ready(end) for end in ends):
                try:
                    self._check(link)
                except definition.ServerRefused as error:
                    self._notify(ServerEventType.LINK_REFUSED, link.target.node, str(error))
                else:
                    self._make(now_us, link)

    def layout(self, name: definition.PdoName) -> PdoLayout:
        """Return a PDO of a node that is ready; ServerRefused if it has none."""
        if name.node not in self._nodes or not self._ready(name.node):
            raise definition.ServerRefused(f"node {name.node} is not ready")
        return find_layout(name, self._nodes[name.node].layouts)

    def _ready(self, node_id: int) -> bool:
        return self._nodes[node_id].phase is NodePhase.READY

    def _check(self, link: definition.PdoLink) -> None:
        check_lengths(link, self.layout(link.source), self.layout(link.target))

    def _make(self, now_us: int, link: definition.PdoLink) -> None:
        """Give the RPDO the COB-ID of the TPDO."""
        cob_id = self.layout(link.source).cob_id
        if self._made.get(link) != cob_id:
            self._write(now_us, link, cob_id, linked=True)

    def _write(self, now_us: int, link: definition.PdoLink, cob_id: int, *, linked: bool) -> None:
        node, text = self._nodes[link.target.node], f"{link.source} to {link.target}"

        def done(_: None) -> None:
            for sink in node.proxy.sinks if node.proxy else ():
                if sink.layout.index == link.target.index:
                    sink.linked = linked
            if linked:
                self._made[link] = cob_id
            kind = ServerEventType.PDO_LINKED if linked else ServerEventType.PDO_UNLINKED
            self._notify(kind, node.entry.id, f"{text}: {cob_id:03X}h")

        def failed(failure: Failure) -> None:
            self._notify(ServerEventType.LINK_REFUSED, node.entry.id, f"{text}: {failure}")

        script = set_pdo(link.target.index, definition.PdoEntry(cob_id=cob_id))
        node.run(now_us, QueuedScript("link", script, done, failed, moves=False))


def find_layout(name: definition.PdoName, layouts: Iterable[PdoLayout]) -> PdoLayout:
    """Return that of a PDO; ServerRefused if it is off."""
    for layout in layouts:
        if layout.index == name.index:
            return layout
    raise definition.ServerRefused(f"{name} is off, or not there")


def check_lengths(link: definition.PdoLink, source: PdoLayout, target: PdoLayout) -> None:
    """Raise ServerRefused if the frame of one is not as long as that of the other.

    Dummy bits fill up an RPDO, and nothing the TPDO of the same Booleans.
    """
    if source.size != target.size:
        raise definition.ServerRefused(
            f"{link.source} has {source.bits} bits, {link.target} has {target.bits}"
        )
