"""Connections of nodes: connectors of ports through the PC, and PDO links without it (Fig. 120)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from tickrig.host.canopen.dialogue import Failure, QueuedScript
from tickrig.host.rtc.canopen import definition
from tickrig.host.rtc.canopen.boot import set_pdo
from tickrig.host.rtc.canopen.events import Notify, ServerEventType
from tickrig.host.rtc.canopen.pdo_layout import PdoLayout
from tickrig.host.rtc.canopen.served_node import NodePhase, ServedNode
from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.ports.port import ConnectorProfile
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.manager import Manager


class PortConnections:
    """Connections between ports that a server should make, each as soon as both ports exist.

    If a component is removed and returns, its connections are made again.

    Args:
        manager: manager with the ports.
        wanted: connections to make.
        notify: function that is called with the result of each attempt.

    Attributes:
        wanted: connections that have not been made.
    """

    def __init__(
        self, manager: Manager, wanted: tuple[definition.RtConnection, ...], notify: Notify
    ) -> None:
        self._manager, self._notify = manager, notify
        self.wanted = list(wanted)
        self._refused = set[str]()

    @property
    def all(self) -> tuple[definition.RtConnection, ...]:
        """The existing connections, followed by those that are not made yet."""
        made = (_entry(profile) for profile in self._manager.connectors)
        return (*made, *self.wanted)

    def make(self) -> None:
        """Make all connections whose ports exist. Give up a connection that is impossible."""
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
        """Remember the connections of a component that is removed, to make them again later."""
        profiles = (
            connector.profile
            for port in component.ports.values()
            for connector in port.connectors
            if connector.joins_components
        )
        self.wanted += (_entry(profile) for profile in profiles)

    def forget(self, first: str, second: str) -> bool:
        """Remove a connection from those that are still to be made.

        Return False if the connection was not waiting to be made.
        """
        ends = {first, second}
        waiting = [entry for entry in self.wanted if {entry.source, entry.target} == ends]
        self.wanted = [entry for entry in self.wanted if entry not in waiting]
        return bool(waiting)

    def _refuse(self, text: str) -> None:
        """Report a missing port once. Another boot of its device may bring the port."""
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
    """Return whether both components of a connection exist, so that it can be made.

    Raise RtcRefused if a component exists, but does not have the port.
    """
    names = {component.instance_name for component in manager.components}
    ends = [end for end in (entry.source, entry.target) if end.rpartition(".")[0] in names]
    for end in ends:
        manager.port(end)
    return len(ends) == 2


def _entry(profile: ConnectorProfile) -> definition.RtConnection:
    source, target = profile.ports
    return definition.RtConnection(source, target, dict(profile.properties))


class PdoLinks:
    """PDO links between nodes, by which a node directly receives a PDO that another node sends.

    A link sets the CAN-ID of an RPDO of one node to that of a TPDO of the other node. The link is
    made when both nodes are ready.

    Args:
        nodes: nodes by node-ID.
        links: PDO links of the System Definition.
        notify: function that is called with the result for each link.

    Attributes:
        links: all wanted links, whether they are made or not.
    """

    def __init__(
        self, nodes: Mapping[int, ServedNode], links: tuple[definition.PdoLink, ...], notify: Notify
    ) -> None:
        self._nodes, self._notify = nodes, notify
        self.links = list(links)
        self._made: dict[definition.PdoLink, int] = {}  # by which CAN-ID
        self._own: dict[definition.PdoName, int] = {}  # CAN-ID of an RPDO without its link

    def add(self, now_us: int, link: definition.PdoLink) -> None:
        """Add a PDO link and make it.

        Raise ServerRefused if that is not possible now.
        """
        for other in self.links:
            if other.target == link.target:
                raise definition.ServerRefused(f"{other.source} and {other.target} are linked")
        self._check(link)
        self.links.append(link)
        self._make(now_us, link)

    def remove(self, now_us: int, link: definition.PdoLink) -> None:
        """Remove a PDO link: give the RPDO its own COB-ID back.

        Raise ServerRefused if there is no such link.
        """
        if link not in self.links:
            raise definition.ServerRefused(f"{link.source} and {link.target} are not linked")
        own = self._own.get(link.target, self.layout(link.target).cob_id)
        self.links.remove(link)
        self._made.pop(link, None)
        self._write(now_us, link, own, linked=False)

    def make(self, now_us: int, node_id: int) -> None:
        """Make the PDO links of a node that has just become ready.

        A link is stored in the target node, as the COB-ID of an RPDO. When the source node is
        reset, the target keeps the link. So the link is not made again.
        """
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
        """Return the layout of a PDO of a node that is ready.

        Raise ServerRefused if the node is not ready, or does not have the PDO.
        """
        if name.node not in self._nodes or not self._ready(name.node):
            raise definition.ServerRefused(f"node {name.node} is not ready")
        return find_layout(name, self._nodes[name.node].layouts)

    def _ready(self, node_id: int) -> bool:
        return self._nodes[node_id].phase is NodePhase.READY

    def _check(self, link: definition.PdoLink) -> None:
        check_lengths(link, self.layout(link.source), self.layout(link.target))

    def _make(self, now_us: int, link: definition.PdoLink) -> None:
        """Set the COB-ID of the RPDO to the COB-ID of the TPDO."""
        cob_id, own = self.layout(link.source).cob_id, self.layout(link.target).cob_id
        if own != cob_id:  # else the node was set up again while it was linked
            self._own[link.target] = own
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
    """Return the layout of a PDO from the layouts of its node.

    Raise ServerRefused if the PDO is off or does not exist.
    """
    for layout in layouts:
        if layout.index == name.index:
            return layout
    raise definition.ServerRefused(f"{name} is off, or not there")


def check_lengths(link: definition.PdoLink, source: PdoLayout, target: PdoLayout) -> None:
    """Raise ServerRefused if the two PDOs of a link differ in length.

    The lengths of the frames are compared in bytes, because the numbers of bits may differ: an RPDO
    with Booleans is filled up with dummy bits, and a TPDO with the same Booleans is not.
    """
    if source.size != target.size:
        raise definition.ServerRefused(
            f"{link.source} has {source.bits} bits, {link.target} has {target.bits}"
        )
