"""The RTC-CANopen server: NMT master, heartbeat consumer, maker of proxies (Fig. 108)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from tickrig.host.canopen.periodic_timer import PeriodicTimer
from tickrig.host.links.link import StampedFrames
from tickrig.host.rtc.canopen.connections import PdoLinks, PortConnections
from tickrig.host.rtc.canopen.data_flow import PdoDataFlow, SdoDataFlow
from tickrig.host.rtc.canopen.definition.definition import NodeEntry, SystemDefinition
from tickrig.host.rtc.canopen.definition.device_file import DeviceFile
from tickrig.host.rtc.canopen.events import EventLog, ServerEventType
from tickrig.host.rtc.canopen.node.receiver import QUIET_US, SYNC_COB_ID, FrameDispatcher
from tickrig.host.rtc.canopen.node.served_node import NodePhase, ServedNode
from tickrig.host.rtc.canopen.proxy.proxy import ProxyRtc
from tickrig.host.rtc.canopen.proxy.sdo_ports import lay_out_sdo_ports
from tickrig.host.rtc.execution.execution_context import ExecutionContext
from tickrig.host.rtc.states import LifeCycleState, ReturnCode, RtcRefused
from tickrig.host.rtc.system.manager import Manager
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.can_error import ErrorState
from tickrig.wire.canopen.nmt import (
    ERROR_CONTROL_COB_ID,
    NMT_COB_ID,
    NmtCommand,
    NmtState,
)
from tickrig.wire.instant import NEVER
from tickrig.wire.rtc_types.idl import Struct

LATE_US: Final = 100_000
"""A server that looks so much later than it wanted to knows nothing of the nodes meanwhile."""


class RtcCanopenServer:
    """Runs the nodes of a System Definition; it has no clock and no bus, it is ticked.

    `tick` takes the time and what was heard, and returns what is to be sent, as
    devices do: the same server runs in virtual time on a rig and on a real bus.

    Not emulated: flying master, TIME, program download, a CANopen node for
    each proxy on the bus.

    Args:
        definition: what it manages.
        files: what the EDS files say, by their names in the definition.
        manager: has the proxies and all other components; an own one if left out.

    Attributes:
        manager: as given.
        nodes: by node-ID.
        log: what happened.
        connections: connectors through the PC.
        links: PDO links.
        findings: what is wrong in the EDS files.
        now_us: the time it was told last.
        due_us: when `tick` has something to do.
    """

    def __init__(
        self,
        definition: SystemDefinition,
        files: Mapping[str, DeviceFile],
        manager: Manager | None = None,
    ) -> None:
        self.definition, self.manager = definition, manager or Manager()
        self.findings = tuple(odd for file in files.values() for odd in file.findings)
        self.log, self._out = EventLog(), list[CanFrame]()
        self.now_us, self.due_us, self._nodes_due_us = 0, 0, NEVER
        self._started, self._quiet_us, self._late_us = False, 0, 0
        self._heartbeat = PeriodicTimer(1_000 * definition.master.heartbeat_ms)
        self._sync = PeriodicTimer(1_000 * definition.master.sync_ms)
        self._bus_states: list[ErrorState] = []
        self._context = ExecutionContext(definition.master.rate_hz)
        self.nodes = {entry.id: self._node(entry, files) for entry in definition.nodes}
        self.links = PdoLinks(self.nodes, definition.pdo_links, self.notify)
        self.connections = PortConnections(self.manager, definition.rt_connections, self.notify)
        self._receiver = FrameDispatcher(self.nodes, definition, self)
        self._data = PdoDataFlow(self.nodes, self.send, self.notify)
        self._by_sdo = SdoDataFlow(self.nodes, self.notify)
        self._start_order = tuple(self.nodes[node_id] for node_id in definition.start_order)
        self._states: dict[int, LifeCycleState] = {}

    def tick(self, now_us: int, rx: StampedFrames, /) -> Frames:
        """Take all that was on the bus by now; do what is due; return what is to be sent."""
        late_us, self.now_us = now_us - self.due_us, now_us
        if not self._started:
            self._start()
        elif late_us >= LATE_US:
            self._be_late(late_us)
        if self._bus_states:
            self._on_bus_states()
        for at_us, frame in rx:
            if not (frame.remote or frame.extended or self._data.receive(at_us, frame)):
                self._receiver.receive(now_us, at_us, frame)
        if self._nodes_due_us <= now_us:
            self._tick_nodes()
        begins = self._context.due_us <= now_us
        if begins:
            self.connections.make()
        self.manager.tick(now_us)
        if begins:
            self._carry_out()
            self._activate_next()
        self._data.send_values()
        if begins:
            self._by_sdo.exchange(now_us)
        if self._sync.advance(now_us):
            self.send(SYNC_COB_ID, b"")
        if self._heartbeat.advance(now_us):
            self._error_control(NmtState.OPERATIONAL)
        timers_us = min(self._heartbeat.due_us, self._sync.due_us)
        self.due_us = min(self._nodes_due_us, self.manager.due_us, timers_us)
        out, self._out = tuple(self._out), []
        return out

    def stop(self, now_us: int) -> Frames:
        """End all proxies, and leave the nodes as the definition says (K14, finalize)."""
        self.now_us = now_us
        for node in self.nodes.values():
            node.dialogue.clear()
            self.gone(node)
            self._command(NmtCommand.RESET_COMMUNICATION, node.entry.id)
            if self.definition.master.leave == "stopped":
                self._command(NmtCommand.STOP, node.entry.id)
        out, self._out = tuple(self._out), []
        return out

    def bus_state(self, state: ErrorState, /) -> None:
        """Tell what its CAN controller reports; it is seen to in the next tick."""
        self._bus_states.append(state)
        self.due_us = self.now_us

    def put(self, name: str, value: Struct) -> ReturnCode:
        """Send a value to a device past all connectors, by the full name of an InPort.

        Returns:
            BAD_PARAMETER if there is no such port or the value does not fit,
            PRECONDITION_NOT_MET while its proxy is not Active or another device sends it.
        """
        result = self._by_sdo.put(name, value)
        return self._data.put(name, value) if result is None else result

    def start(self) -> None:
        """Activate all nodes in the start order, each when those before it are Active.

        A node that does not come holds up those behind it.
        """
        for node in self._start_order:
            node.to_start = True

    def notify(self, kind: ServerEventType, node: int, text: str = "", /) -> None:
        """Take an event."""
        self.log.notify(self.now_us, kind, node, text)

    def send(self, can_id: int, data: bytes, /) -> None:
        """Send a frame with this tick's traffic."""
        self._out.append(CanFrame(can_id, data))

    def wake(self, due_us: int, /) -> None:
        """Tick the nodes at a time at the latest."""
        self._nodes_due_us = min(self._nodes_due_us, due_us)
        self.due_us = min(self.due_us, due_us)

    def booted(self, node: ServedNode, /) -> None:
        """Make the proxy of a node that has booted, its links and connections."""
        try:
            self._make_proxy(node)
        except RtcRefused as error:  # its name, or that of a port, is there twice
            node.refuse(str(error))
            self.notify(ServerEventType.PROXY_REFUSED, node.entry.id, str(error))
            return
        node.to_start = node.to_start or self.definition.start.autoactivate
        self.links.make(self.now_us, node.entry.id)

    def gone(self, node: ServedNode, /) -> None:
        """Remove the proxy of a node."""
        if (proxy := node.proxy) is None:
            return
        node.operations.proxy = None
        if self.definition.master.reconnect:
            self.connections.keep(proxy)
        self.manager.delete(proxy.instance_name)
        self._states.pop(node.entry.id, None)
        self._data.route()
        self.notify(ServerEventType.PROXY_REMOVED, node.entry.id, proxy.instance_name)

    def _node(self, entry: NodeEntry, files: Mapping[str, DeviceFile]) -> ServedNode:
        writes = tuple(write for write in self.definition.sdo if write.node == entry.id)
        remove_us = 1_000 * self.definition.master.remove_after_ms
        return ServedNode(entry, files[entry.eds], writes, remove_us, self)

    def _start(self) -> None:
        self._started = True
        self.manager.tick(self.now_us)
        self.manager.add_context(self._context)
        self._context.start()
        self._error_control(NmtState.INITIALISING)
        self._heartbeat.start(self.now_us)
        self._sync.start(self.now_us)
        for node in self.nodes.values():
            node.search(self.now_us)

    def _be_late(self, late_us: int) -> None:
        """Say so, at most once a second, and take no node for silent in that time."""
        self._late_us = max(self._late_us, late_us)
        for node in self.nodes.values():
            node.pause(self.now_us, late_us)
        if self.now_us >= self._quiet_us:
            self.notify(ServerEventType.SERVER_LATE, 0, f"looked {self._late_us // 1_000} ms late")
            self._quiet_us, self._late_us = self.now_us + QUIET_US, 0

    def _make_proxy(self, node: ServedNode) -> None:
        if node.proxy is not None:
            return
        by_sdo, refused = lay_out_sdo_ports(node.entry, node.file.data_types)
        proxy = ProxyRtc(node.entry, node.layouts, by_sdo)
        node.operations.proxy = self.manager.add(proxy, context=self._context)
        for text in refused:
            self.notify(ServerEventType.PORT_REFUSED, node.entry.id, text)
        for layout in node.layouts:
            if layout.unknown:
                mapped = ", ".join(f"{m.index:04X}h:{m.sub:02X}" for m in layout.unknown)
                text = f"{layout.name}: no port has the type of {mapped}"
                self.notify(ServerEventType.PORT_REFUSED, node.entry.id, text)
        self.notify(ServerEventType.PROXY_MADE, node.entry.id, proxy.instance_name)
        self._data.watch(node)

    def _on_bus_states(self) -> None:
        """See to what the CAN controller reported: bus-off leaves all proxies in Error."""
        states, self._bus_states = self._bus_states, []
        for state in states:
            if state is ErrorState.BUS_OFF:
                self.notify(ServerEventType.BUS_OFF, 0, "the server can neither hear nor send")
                for node in self.nodes.values():
                    node.operations.abort()
            elif state is ErrorState.ACTIVE:
                self.notify(ServerEventType.BUS_ON, 0)

    def _tick_nodes(self) -> None:
        self._nodes_due_us = NEVER
        for node in self.nodes.values():
            if node.due_us <= self.now_us:
                node.tick(self.now_us)
        self._nodes_due_us = min(node.due_us for node in self.nodes.values())

    def _carry_out(self) -> None:
        for node in self.nodes.values():
            if node.proxy is not None:
                node.carry_out(self.now_us)
                self._notify_state(node, node.proxy)

    def _activate_next(self) -> None:
        """Activate the next node of the start order, if it is to start and is ready."""
        for node in self._start_order:
            if node.proxy is None or not node.proxy.confirmed:
                if node.to_start and node.phase is NodePhase.READY and node.proxy is not None:
                    node.to_start = False
                    node.proxy.contexts[0].activate_component(node.proxy)
                return

    def _notify_state(self, node: ServedNode, proxy: ProxyRtc) -> None:
        before, state = self._states.get(node.entry.id), proxy.state
        if state is before:
            return
        self._states[node.entry.id] = state
        if before is not None:
            text = f"{before.name} to {state.name}"
            self.notify(ServerEventType.STATE_CHANGED, node.entry.id, text)
        if state is not LifeCycleState.ERROR:
            proxy.ready = False

    def _error_control(self, state: NmtState) -> None:
        self.send(ERROR_CONTROL_COB_ID + self.definition.master.node, bytes((state,)))

    def _command(self, command: NmtCommand, node_id: int) -> None:
        self.send(NMT_COB_ID, bytes((command, node_id)))
