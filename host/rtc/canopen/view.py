"""A running server as tools see it: what is there, and what can be done."""

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
    """A port of a proxy.

    Attributes:
        name: full name, such as `Palette0.ai`.
        data_type: name of its type, such as `TimedShort`.
        out: whether it is an OutPort.
        peers: full names of the ports that it is connected with.
        pdo: the PDO that carries its values; None if no PDO does.
    """

    name: str
    data_type: str
    out: bool
    peers: tuple[str, ...]
    pdo: PdoName | None = None


@dataclass(frozen=True, slots=True)
class PdoView:
    """An enabled PDO of a device.

    Attributes:
        name: such as `16.tpdo2`.
        cob_id: its CAN-ID; for a linked RPDO the CAN-ID of the source.
        bits: its length in bits.
        index: index of its communication parameter in the device.
        proxy_index: index of this parameter in the proxy.
    """

    name: PdoName
    cob_id: int
    bits: int
    index: int
    proxy_index: int


@dataclass(frozen=True, slots=True)
class NodeView:
    """A node and its proxy.

    Attributes:
        nmt_state: such as `OPERATIONAL`; empty before its first frame.
        heartbeat_age_us: time since its last frame; `NOT_HEARD` before the first frame.
        late: whether its heartbeat is missing.
        proxy_state: such as `ACTIVE`; empty without a proxy.
        problem: the reason why the node is refused; empty if it is not refused.
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
    """A component that is not a proxy.

    Attributes:
        state: its state, such as `ACTIVE`.
    """

    name: str
    type_name: str
    state: str
    ports: tuple[PortView, ...]


@dataclass(frozen=True, slots=True)
class SystemView:
    """All that there is, at one time; see the properties of `ServerView`."""

    nodes: tuple[NodeView, ...]
    components: tuple[ComponentView, ...]
    links: tuple[PdoLink, ...]
    connections: tuple[RtConnection, ...]
    waiting: tuple[RtConnection, ...]


_T = TypeVar("_T")


class PendingTransfer(Generic[_T]):
    """SDO transfers with a waiting caller.

    Args:
        empty: the result until the transfers have ended.

    Attributes:
        done: whether the transfers have ended.
        data: the values read; `empty` after a write.
        problem: the reason for a failure; empty if the transfers did not fail.
    """

    def __init__(self, empty: _T) -> None:
        self.done, self.data, self.problem = False, empty, ""

    def succeed(self, data: _T | None) -> None:
        """Take the result."""
        self.done = True
        if data is not None:
            self.data = data

    def fail(self, failure: Failure | str) -> None:
        """Take what went wrong."""
        self.done, self.problem = True, str(failure)

    def drop(self) -> None:
        """Take that the server had to do something else first."""
        self.fail("given up: the node was reset, stopped or lost")


class ServerView:
    """Reads the state of a server and sends it commands, between its ticks and in its thread.

    Commands return at once; their results appear in the states and events.

    Args:
        server: the server.
    """

    def __init__(self, server: RtcCanopenServer) -> None:
        self._server = server

    @property
    def nodes(self) -> tuple[NodeView, ...]:
        """All nodes, in the order of the definition."""
        return tuple(self._view(node) for node in self._server.nodes.values())

    @property
    def system(self) -> SystemView:
        """All that there is."""
        return SystemView(self.nodes, self.components, self.links, self.connections, self.waiting)

    @property
    def components(self) -> tuple[ComponentView, ...]:
        """All components that are no proxies."""
        components = self._server.manager.components
        return tuple(_component(one) for one in components if not isinstance(one, ProxyRtc))

    @property
    def events(self) -> tuple[ServerEvent, ...]:
        """What happened, the latest last."""
        return self._server.log.events

    @property
    def links(self) -> tuple[PdoLink, ...]:
        """PDO links that are wanted."""
        return tuple(self._server.links.links)

    @property
    def connections(self) -> tuple[RtConnection, ...]:
        """Connections through the PC, those that are made first."""
        return self._server.connections.all

    @property
    def waiting(self) -> tuple[RtConnection, ...]:
        """Connections whose ports are not there yet."""
        return tuple(self._server.connections.wanted)

    def node(self, node_id: int) -> NodeView:
        """Return one node; ServerRefused if there is none."""
        return self._view(self._node(node_id))

    def activate(self, name: str) -> None:
        """Ask for Active; RtcRefused if the proxy or component cannot."""
        self._server.manager.activate(name)

    def deactivate(self, name: str) -> None:
        """Ask for Inactive; RtcRefused if the proxy or component cannot."""
        self._server.manager.deactivate(name)

    def reset(self, name: str) -> None:
        """Ask for Error to Inactive; RtcRefused if the proxy or component cannot."""
        self._server.manager.reset(name)

    def start(self) -> None:
        """Activate all nodes in the start order."""
        self._server.start()

    def boot(self, node_id: int) -> None:
        """Set up a node again, also a refused one; it gets a new proxy."""
        self._node(node_id).boot(self._server.now_us)

    def restart(self, node_id: int) -> None:
        """Reset a node by NMT, one that was lost, too; it is Active again if it was."""
        self._node(node_id).restart(self._server.now_us)

    def connect(self, first: str, second: str, properties: Mapping[str, str] | None = None) -> None:
        """Join two ports through the PC; RtcRefused if they do not fit."""
        self._server.manager.connect(first, second, properties)

    def disconnect(self, first: str, second: str) -> None:
        """End such a connection, one that waits for its ports, too; RtcRefused if there is none."""
        if not self._server.connections.forget(first, second):
            self._server.manager.disconnect(first, second)

    def link(self, source: PdoName, target: PdoName) -> None:
        """Let an RPDO receive a TPDO without the PC; ServerRefused if they do not fit."""
        self._server.links.add(self._server.now_us, PdoLink(source, target))

    def unlink(self, source: PdoName, target: PdoName) -> None:
        """End such a link; ServerRefused if there is none."""
        self._server.links.remove(self._server.now_us, PdoLink(source, target))

    def read(self, node_id: int, index: int, sub: int) -> PendingTransfer[bytes]:
        """Read an object of a device; ServerRefused if there is no such node."""
        return self._transfer(node_id, upload(index, sub), b"")

    def write(self, node_id: int, index: int, sub: int, data: bytes) -> PendingTransfer[bytes]:
        """Write an object of a device; ServerRefused if there is no such node."""
        return self._transfer(node_id, download(index, sub, data), b"")

    def read_pdos(self, node_id: int) -> PendingTransfer[pdo_edit.Pdos]:
        """Read all PDOs of a device; ServerRefused if it does not answer now."""
        node = self._node(node_id)
        pdo_edit.check_answers(node)
        return self._transfer(node_id, pdo_edit.read_pdos(node.file), {})

    def write_pdos(
        self, node_id: int, before: pdo_edit.Pdos, wanted: pdo_edit.Pdos
    ) -> PendingTransfer[None]:
        """Change PDOs of a device, and set it up again; ServerRefused if that is not possible now.

        Args:
            node_id: the node.
            before: the PDOs that the node has.
            wanted: the new descriptions of some of these PDOs.
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
        """Read what a DCF contains of a device; ServerRefused if it does not answer now."""
        pdo_edit.check_answers(self._node(node_id))
        return self._transfer(node_id, pdo_edit.read_parameters(eds), {})

    def device_file(self, node_id: int) -> DeviceFile:
        """Return what the EDS of a node says; ServerRefused if there is no such node."""
        return self._node(node_id).file

    def definition(self) -> SystemDefinition:
        """Return the definition with PDOs, connections and links as they are now."""
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
    """Return the data ports; service ports cannot be joined with those of a device."""
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
