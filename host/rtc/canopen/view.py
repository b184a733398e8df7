"""A running server as tools see it, with its state and its commands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, Generic, TypeVar

from tickrig.host.canopen.dialogue import Failure, QueuedScript, Script
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.host.rtc.canopen import pdo_edit
from tickrig.host.rtc.canopen.definition import (
    DeviceFile,
    PdoLink,
    PdoName,
    Role,
    RtConnection,
    ServerRefused,
    SystemDefinition,
)
from tickrig.host.rtc.canopen.events import ServerEvent
from tickrig.host.rtc.canopen.pdo_layout import PdoLayout, proxy_index
from tickrig.host.rtc.canopen.proxy import PdoSink, PdoSource, ProxyRtc
from tickrig.host.rtc.canopen.served_node import NodePhase, ServedNode
from tickrig.host.rtc.canopen.server import RtcCanopenServer
from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.ports.data_port import DataPort, OutPort

NOT_HEARD: Final = -1


@dataclass(frozen=True, slots=True)
class PortView:
    """Description of a data port of a proxy or component, as the editor shows it.

    Attributes:
        name: full name of the port, such as `Palette0.ai`.
        data_type: name of the data type, such as `TimedShort`.
        out: whether the port is an OutPort.
        peers: full names of the connected ports.
        pdo: PDO that carries the values of the port, or None if no PDO does.
    """

    name: str
    data_type: str
    out: bool
    peers: tuple[str, ...]
    pdo: PdoName | None = None


@dataclass(frozen=True, slots=True)
class PdoView:
    """Description of an enabled PDO of a device, as the editor shows it.

    Attributes:
        name: name of the PDO, such as `16.tpdo2`.
        cob_id: CAN-ID of the PDO. For a linked RPDO, it is the CAN-ID of the source.
        bits: length of the PDO in bits.
        index: index of the PDO communication parameter in the device, such as 1800h.
        proxy_index: index of the opposite PDO in the proxy. For TPDO 1800h of the device, it is
            RPDO 1400h.
    """

    name: PdoName
    cob_id: int
    bits: int
    index: int
    proxy_index: int


@dataclass(frozen=True, slots=True)
class NodeView:
    """Present state of a CANopen node and its proxy, as the editor shows it.

    Attributes:
        node_id: node-ID of the node.
        name: instance name of the proxy.
        role: type of the device.
        phase: phase of the set-up of the node.
        nmt_state: NMT state such as `OPERATIONAL`, empty before the first frame.
        heartbeat_age_us: time in us since the last frame, or `NOT_HEARD` before the first frame.
        late: whether the heartbeat of the node is missing.
        proxy_state: state of the proxy such as `ACTIVE`, empty without a proxy.
        problem: reason why the node is refused, empty if it is not refused.
        ports: ports of the proxy.
        pdos: enabled PDOs of the device.
    """

    node_id: int
    name: str
    role: Role
    phase: NodePhase
    nmt_state: str
    heartbeat_age_us: int
    late: bool
    proxy_state: str
    problem: str
    ports: tuple[PortView, ...]
    pdos: tuple[PdoView, ...]


@dataclass(frozen=True, slots=True)
class ComponentView:
    """Present state of a component that does not represent a node, as the editor shows it.

    Attributes:
        name: instance name of the component.
        type_name: type name of the component.
        state: state of the component, such as `ACTIVE`.
        ports: data ports of the component.
    """

    name: str
    type_name: str
    state: str
    ports: tuple[PortView, ...]


@dataclass(frozen=True, slots=True)
class SystemView:
    """State of a whole system at one time: nodes, components, links and connections."""

    nodes: tuple[NodeView, ...]
    components: tuple[ComponentView, ...]
    links: tuple[PdoLink, ...]
    connections: tuple[RtConnection, ...]
    waiting: tuple[RtConnection, ...]


_T = TypeVar("_T")


class PendingTransfer(Generic[_T]):
    """Result of SDO transfers that run in the background.

    The caller checks `done` from time to time.

    Args:
        empty: initial value of `data`.

    Attributes:
        done: whether the transfers have ended.
        data: values that were read. Before the end of the transfers, and after a write, it is
            `empty`.
        problem: reason for a failure, empty if the transfers did not fail.
    """

    def __init__(self, empty: _T) -> None:
        self.done, self.data, self.problem = False, empty, ""

    def succeed(self, data: _T | None) -> None:
        """Store the result."""
        self.done = True
        if data is not None:
            self.data = data

    def fail(self, failure: Failure | str) -> None:
        """Store the error."""
        self.done, self.problem = True, str(failure)

    def drop(self) -> None:
        """Record that the server dropped the transfers in favour of other work."""
        self.fail("given up: the node was reset, stopped or lost")


class ServerView:
    """Interface by which the editor reads the state of a CANopen server and sends it commands.

    Call its methods only in the server's thread, and not during a call of `RtcCanopenServer.tick`.
    Commands return at once, and their results appear later in the states and events.

    Args:
        server: server to view.
    """

    def __init__(self, server: RtcCanopenServer) -> None:
        self._server = server

    @property
    def nodes(self) -> tuple[NodeView, ...]:
        """All nodes, in the order of the definition."""
        return tuple(self._view(node) for node in self._server.nodes.values())

    @property
    def system(self) -> SystemView:
        """All parts of the system."""
        return SystemView(self.nodes, self.components, self.links, self.connections, self.waiting)

    @property
    def components(self) -> tuple[ComponentView, ...]:
        """All components that are not proxies."""
        components = self._server.manager.components
        return tuple(_component(one) for one in components if not isinstance(one, ProxyRtc))

    @property
    def events(self) -> tuple[ServerEvent, ...]:
        """The events of the server. The latest event is last."""
        return self._server.log.events

    @property
    def links(self) -> tuple[PdoLink, ...]:
        """The wanted PDO links."""
        return tuple(self._server.links.links)

    @property
    def connections(self) -> tuple[RtConnection, ...]:
        """Connections through the PC. The existing connections are first, then the pending ones."""
        return self._server.connections.all

    @property
    def waiting(self) -> tuple[RtConnection, ...]:
        """Connections whose ports do not exist yet."""
        return tuple(self._server.connections.wanted)

    def node(self, node_id: int) -> NodeView:
        """Return the present state of one node. Raise ServerRefused if there is no such node."""
        return self._view(self._node(node_id))

    def activate(self, name: str) -> None:
        """Request that a proxy or component moves to Active.

        Raise RtcRefused if that is not possible.
        """
        self._server.manager.activate(name)

    def deactivate(self, name: str) -> None:
        """Request that a proxy or component moves to Inactive.

        Raise RtcRefused if that is not possible.
        """
        self._server.manager.deactivate(name)

    def reset(self, name: str) -> None:
        """Request that a proxy or component moves from Error to Inactive.

        Raise RtcRefused if that is not possible.
        """
        self._server.manager.reset(name)

    def start(self) -> None:
        """Activate all nodes in the start order."""
        self._server.start()

    def boot(self, node_id: int) -> None:
        """Set up a node again, even if it was refused before. The node gets a new proxy."""
        self._node(node_id).boot(self._server.now_us)

    def restart(self, node_id: int) -> None:
        """Reset a node by NMT, even if it is lost.

        If the node was Active, it becomes Active again.
        """
        self._node(node_id).restart(self._server.now_us)

    def connect(self, first: str, second: str, properties: Mapping[str, str] | None = None) -> None:
        """Connect two ports through the PC. Raise RtcRefused if they do not fit."""
        self._server.manager.connect(first, second, properties)

    def disconnect(self, first: str, second: str) -> None:
        """End the connection of two ports through the PC, or cancel it if it waits for a port.

        Raise RtcRefused if there is no such connection.
        """
        if not self._server.connections.forget(first, second):
            self._server.manager.disconnect(first, second)

    def link(self, source: PdoName, target: PdoName) -> None:
        """Link two nodes, so that the RPDO of one node directly receives the TPDO of the other.

        Raise ServerRefused if the PDOs do not fit.

        Args:
            source: TPDO of the sending node.
            target: RPDO of the receiving node.
        """
        self._server.links.add(self._server.now_us, PdoLink(source, target))

    def unlink(self, source: PdoName, target: PdoName) -> None:
        """End the direct link between a TPDO and an RPDO of two nodes.

        Raise ServerRefused if there is no such link.
        """
        self._server.links.remove(self._server.now_us, PdoLink(source, target))

    def read(self, node_id: int, index: int, sub: int) -> PendingTransfer[bytes]:
        """Start reading an object of a device by SDO. The result appears in the returned transfer.

        Raise ServerRefused if there is no such node.
        """
        return self._transfer(node_id, upload(index, sub), b"")

    def write(self, node_id: int, index: int, sub: int, data: bytes) -> PendingTransfer[bytes]:
        """Start writing an object of a device by SDO. The result appears in the returned transfer.

        Raise ServerRefused if there is no such node.
        """
        return self._transfer(node_id, download(index, sub, data), b"")

    def read_pdos(self, node_id: int) -> PendingTransfer[pdo_edit.Pdos]:
        """Start reading all PDOs of a device. The result appears in the returned transfer.

        Raise ServerRefused if the device does not answer now.
        """
        node = self._node(node_id)
        pdo_edit.check_answers(node)
        return self._transfer(node_id, pdo_edit.read_pdos(node.file), {})

    def write_pdos(
        self, node_id: int, before: pdo_edit.Pdos, wanted: pdo_edit.Pdos
    ) -> PendingTransfer[None]:
        """Start writing changed PDOs into a device. The device is then set up again.

        Raise ServerRefused if that is not possible now.

        Args:
            node_id: node-ID of the node.
            before: PDOs that the node has.
            wanted: new descriptions of those PDOs that change.
        """
        node, transfer = self._node(node_id), PendingTransfer(None)
        linked = {link.target.index for link in self.links if link.target.node == node_id}
        rewrite = pdo_edit.Rewrite(node, before, wanted, linked & wanted.keys())

        def done(_: None) -> None:
            transfer.succeed(None)
            rewrite.done()

        def failed(failure: Failure) -> None:
            transfer.fail(failure)
            rewrite.failed(failure)

        def dropped() -> None:
            transfer.drop()
            transfer.problem += "; its old PDOs are written when it boots"

        job = QueuedScript("PDOs", rewrite.begin(), done, failed, dropped)
        node.run(self._server.now_us, job)
        return transfer

    def read_parameters(self, node_id: int, eds: Path) -> PendingTransfer[Mapping[int, bytes]]:
        """Start reading from a device the values for its DCF.

        The result appears in the returned transfer.

        Raise ServerRefused if the device does not answer now.

        Args:
            node_id: node-ID of the node.
            eds: path of the node's EDS, which lists the values to read.
        """
        pdo_edit.check_answers(self._node(node_id))
        return self._transfer(node_id, pdo_edit.read_parameters(eds), {})

    def device_file(self, node_id: int) -> DeviceFile:
        """Return the data about the device type that the server has read from a node's EDS.

        Raise ServerRefused if there is no such node.
        """
        return self._node(node_id).file

    def definition(self) -> SystemDefinition:
        """Return the System Definition with the present PDOs, connections and links."""
        return replace(
            self._server.definition,
            nodes=tuple(node.entry for node in self._server.nodes.values()),
            pdo_links=self.links,
            rt_connections=self.connections,
        )

    def _node(self, node_id: int) -> ServedNode:
        if (node := self._server.nodes.get(node_id)) is None:
            known = ", ".join(map(str, self._server.nodes))
            raise ServerRefused(f"node {node_id} is not one of: {known}")
        return node

    def _transfer(
        self, node_id: int, script: Script[_T] | Script[None], empty: _T
    ) -> PendingTransfer[_T]:
        transfer = PendingTransfer(empty)
        callbacks = transfer.succeed, transfer.fail, transfer.drop
        job = QueuedScript("transfer", script, *callbacks, moves=False)
        self._node(node_id).run(self._server.now_us, job)
        return transfer

    def _view(self, node: ServedNode) -> NodeView:
        state, proxy = node.nmt_state, node.proxy
        return NodeView(
            node.entry.id,
            node.entry.name,
            node.entry.role,
            node.phase,
            "" if state is None else state.name,
            NOT_HEARD if state is None else self._server.now_us - node.received_us,
            node.lost,
            "" if proxy is None else proxy.state.name,
            node.problem,
            _ports(proxy) if proxy else (),
            tuple(_pdo(node.entry.id, pdo) for pdo in node.layouts),
        )


def _component(component: RtComponent) -> ComponentView:
    state = component.contexts[0].state_of(component).name if component.contexts else ""
    name, type_name = component.instance_name, component.spec.type_name
    return ComponentView(name, type_name, state, _ports(component))


def _ports(component: RtComponent) -> tuple[PortView, ...]:
    """Return the data ports. Service ports cannot be connected with ports of a device."""
    pdos = dict[str, PdoName]()
    if isinstance(component, ProxyRtc):
        carriers: tuple[PdoSource | PdoSink, ...] = (*component.sources, *component.sinks)
        for one in carriers:
            pdo = PdoName(component.node_id, one.layout.name)
            pdos |= {port.full_name: pdo for port in one.ports}
    ports = component.ports.values()
    return tuple(_port(port, pdos) for port in ports if isinstance(port, DataPort))


def _port(port: DataPort[Any], pdos: Mapping[str, PdoName]) -> PortView:
    ends = (end for connector in port.connectors for end in connector.profile.ports)
    name = port.full_name
    peers = tuple(end for end in ends if end != name)
    is_out = isinstance(port, OutPort)
    return PortView(name, port.data_type.__name__, is_out, peers, pdos.get(name))


def _pdo(node_id: int, layout: PdoLayout) -> PdoView:
    return PdoView(
        PdoName(node_id, layout.name),
        layout.cob_id,
        layout.bits,
        layout.index,
        proxy_index(layout.index),
    )
