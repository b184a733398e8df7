"""The RTC-CANopen server: NMT master, heartbeat consumer, maker of proxies (Fig. 108)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from tickrig.host.link import NEVER
from tickrig.host.rtc.execution_context import ExecutionContext
from tickrig.host.rtc.manager import Manager
from tickrig.host.rtc.states import LifeCycleState, ReturnCode
from tickrig.host.rtc_canopen.connections import Connections
from tickrig.host.rtc_canopen.definition import NodeEntry, SystemDefinition
from tickrig.host.rtc_canopen.device_file import DeviceFile
from tickrig.host.rtc_canopen.events import EventKind, EventLog
from tickrig.host.rtc_canopen.links import Links
from tickrig.host.rtc_canopen.pdo_ports import PdoSink, PdoSource
from tickrig.host.rtc_canopen.proxy import ProxyRtc
from tickrig.host.rtc_canopen.served_node import Phase, ServedNode
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.can_error import ErrorState
from tickrig.wire.canopen.emcy import Emcy, EmcyCode, describe
from tickrig.wire.canopen.nmt import (
    ALL_NODES,
    ERROR_CONTROL_COB_ID,
    NMT_COB_ID,
    NmtCommand,
    NmtState,
)
from tickrig.wire.errors import WireError
from tickrig.wire.rtc_types.idl import Struct

EMERGENCY: Final = range(0x081, 0x100)
SDO_RESPONSES: Final = range(0x581, 0x600)
ERROR_CONTROL: Final = range(0x701, 0x780)
QUIET_US: Final = 1_000_000
"""Another master that was not heard for so long is told of anew."""


class Server:
    """Runs the nodes of a System Definition; it has no clock and no bus, it is ticked.

    `tick` takes the time and what was heard, and returns what is to be sent, as
    devices do: the same server runs in virtual time on a rig and on a real bus.

    Not emulated: flying master, SYNC, TIME, program download, a CANopen node for
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
        self.log, self._out = EventLog(), list[CanFrame]()
        self.now_us, self.due_us, self._nodes_due_us = 0, 0, NEVER
        self._started, self._heartbeat_us, self._foreign_us = False, NEVER, -QUIET_US
        self._bus_states: list[ErrorState] = []
        self._context = ExecutionContext(definition.master.rate_hz)
        self._sources: dict[int, tuple[tuple[ServedNode, PdoSource], ...]] = {}
        self._sinks: tuple[tuple[ServedNode, PdoSink], ...] = ()
        self.nodes = {entry.id: self._node(entry, files) for entry in definition.nodes}
        self.links = Links(self.nodes, definition.pdo_links, self.note)
        self.connections = Connections(
            self.manager, definition.rt_connections, lambda kind, text: self.note(kind, 0, text)
        )
        self._states: dict[int, LifeCycleState] = {}

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Take what was heard; do what is due; return what is to be sent."""
        self.now_us = now_us
        if not self._started:
            self._start()
        self._hear_bus()
        for frame in rx:
            if not (frame.remote or frame.extended):
                self._hear(frame)
        if self._nodes_due_us <= now_us:
            self._tick_nodes()
        begins = self._context.due_us <= now_us
        if begins:
            self.connections.make()
        self.manager.tick(now_us)
        if begins:
            self._carry_out()
            self._start_next()
        self._send_values()
        self._send_heartbeat()
        self.due_us = min(self._nodes_due_us, self.manager.due_us, self._heartbeat_us)
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
        for node, sink in self._all_sinks():
            for port in sink.ports:
                if port.full_name == name:
                    return self._send_value(node, sink, port.name, value)
        return ReturnCode.BAD_PARAMETER

    def start(self) -> None:
        """Activate all nodes in the start order, each when those before it are Active."""
        for node in self.nodes.values():
            node.to_start = True

    def note(self, kind: EventKind, node: int, text: str = "", /) -> None:
        """Take an event."""
        self.log.note(self.now_us, kind, node, text)

    def send(self, can_id: int, data: bytes, /) -> None:
        """Send a frame with this tick's traffic."""
        self._out.append(CanFrame(can_id, data))

    def wake(self, due_us: int, /) -> None:
        """Tick the nodes at a time at the latest."""
        self._nodes_due_us = min(self._nodes_due_us, due_us)
        self.due_us = min(self.due_us, due_us)

    def booted(self, node: ServedNode, /) -> None:
        """Make the proxy of a node that has booted, its links and connections."""
        if node.proxy is None:
            self._make_proxy(node)
        node.to_start = node.to_start or self.definition.start.autoactivate
        self.links.make(self.now_us, node.entry.id)

    def gone(self, node: ServedNode, /) -> None:
        """Remove the proxy of a node."""
        if (proxy := node.proxy) is None:
            return
        node.proxy = None
        if self.definition.master.reconnect:
            self.connections.keep(proxy)
        self.manager.delete(proxy.instance_name)
        self._states.pop(node.entry.id, None)
        self._route()
        self.note(EventKind.PROXY_REMOVED, node.entry.id, proxy.instance_name)

    def _node(self, entry: NodeEntry, files: Mapping[str, DeviceFile]) -> ServedNode:
        writes = tuple(write for write in self.definition.sdo if write.node == entry.id)
        remove_us = 1_000 * self.definition.master.remove_ms
        return ServedNode(entry, files[entry.eds], writes, remove_us, self)

    def _start(self) -> None:
        self._started = True
        self.manager.tick(self.now_us)
        self.manager.run_context(self._context)
        self._context.start()
        self._error_control(NmtState.INITIALISING)
        if self.definition.master.heartbeat_ms:
            self._heartbeat_us = self.now_us + 1_000 * self.definition.master.heartbeat_ms
        for node in self.nodes.values():
            node.look(self.now_us)

    def _make_proxy(self, node: ServedNode) -> None:
        proxy = node.proxy = ProxyRtc(node.entry, node.layouts)
        self.manager.add(proxy, context=self._context)
        for layout in node.layouts:
            if layout.unknown:
                mapped = ", ".join(f"{m.index:04X}h:{m.sub:02X}" for m in layout.unknown)
                text = f"{layout.name}: no port has the type of {mapped}"
                self.note(EventKind.PORT_REFUSED, node.entry.id, text)
        self.note(EventKind.PROXY_MADE, node.entry.id, proxy.instance_name)
        for sink in proxy.sinks:
            for port in sink.ports:
                port.on_connect.append(lambda _: self._route())
                port.on_disconnect.append(lambda _: self._route())
        self._route()

    def _route(self) -> None:
        """Collect which PDO goes to which OutPorts, and which InPorts have connectors."""
        sources: dict[int, tuple[tuple[ServedNode, PdoSource], ...]] = {}
        for node in self.nodes.values():
            for source in node.proxy.sources if node.proxy else ():
                cob_id = source.layout.cob_id
                sources[cob_id] = (*sources.get(cob_id, ()), (node, source))
        self._sources = sources
        self._sinks = tuple(
            (node, sink)
            for node, sink in self._all_sinks()
            if any(port.connectors for port in sink.ports)
        )

    def _all_sinks(self) -> Iterator[tuple[ServedNode, PdoSink]]:
        for node in self.nodes.values():
            for sink in node.proxy.sinks if node.proxy else ():
                yield node, sink

    def _hear(self, frame: CanFrame) -> None:
        can_id, node = frame.can_id, self.nodes.get(frame.can_id & 0x7F)
        if can_id in self._sources:
            self._hear_pdo(frame)
        elif can_id == NMT_COB_ID:
            self._hear_command(frame.data)
        elif can_id == ERROR_CONTROL_COB_ID + self.definition.master.node:
            self._hear_master()
        elif node is None:
            return
        elif can_id in ERROR_CONTROL:
            node.hear_error_control(self.now_us, frame.data)
        elif can_id in SDO_RESPONSES:
            node.hear_sdo(self.now_us, frame.data)
        elif can_id in EMERGENCY:
            self._hear_emergency(node, frame.data)

    def _hear_pdo(self, frame: CanFrame) -> None:
        for node, source in self._sources[frame.can_id]:
            if len(frame.data) < source.layout.size:
                text = f"{source.layout.name}: {len(frame.data)} of {source.layout.size} bytes"
                self.note(EventKind.PDO_TOO_SHORT, node.entry.id, text)
            elif node.proxy is not None and node.proxy.passing:
                source.receive(self.now_us, frame.data)

    def _hear_command(self, data: bytes) -> None:
        if len(data) != 2:
            return
        command, node_id = data
        known = command in tuple(NmtCommand)
        text = NmtCommand(command).name if known else f"{command:02X}h"
        self.note(EventKind.FOREIGN_COMMAND, node_id, text if node_id else f"{text} to all")
        for node in self.nodes.values():
            if node_id in (ALL_NODES, node.entry.id):
                node.hear_foreign(self.now_us, command)

    def _hear_master(self) -> None:
        if self.now_us - self._foreign_us >= QUIET_US:
            node_id = self.definition.master.node
            self.note(EventKind.FOREIGN_MASTER, node_id, "another node has the node-ID of ours")
        self._foreign_us = self.now_us

    def _hear_emergency(self, node: ServedNode, data: bytes) -> None:
        try:
            emcy = Emcy.parse(data)
        except WireError:
            return
        text = f"{emcy.code:04X}h {describe(emcy.code)}, error register {emcy.register:02X}h"
        back = emcy.code == EmcyCode.BUS_OFF_RECOVERED
        self.note(EventKind.BUS_OFF if back else EventKind.EMERGENCY, node.entry.id, text)

    def _hear_bus(self) -> None:
        """See to what the CAN controller reported: bus-off leaves all proxies in Error."""
        states, self._bus_states = self._bus_states, []
        for state in states:
            if state is ErrorState.BUS_OFF:
                self.note(EventKind.BUS_OFF, 0, "the server can neither hear nor send")
                for node in self.nodes.values():
                    node.fail(self.now_us)
            elif state is ErrorState.ACTIVE:
                self.note(EventKind.BUS_ON, 0)

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
                self._note_state(node, node.proxy)

    def _note_state(self, node: ServedNode, proxy: ProxyRtc) -> None:
        before, state = self._states.get(node.entry.id), proxy.state
        if state is before:
            return
        self._states[node.entry.id] = state
        if before is not None:
            text = f"{before.name} to {state.name}"
            self.note(EventKind.STATE_CHANGED, node.entry.id, text)
        if state is not LifeCycleState.ERROR:
            proxy.ready = False

    def _start_next(self) -> None:
        """Activate the first node of the order that is not, if it is its turn."""
        for node_id in self.definition.start_order:
            node = self.nodes[node_id]
            if node.proxy is None or not node.proxy.confirmed:
                if node.to_start and node.phase is Phase.READY and node.proxy is not None:
                    node.to_start = False
                    self._context.activate_component(node.proxy)
                return

    def _send_values(self) -> None:
        for node, sink in self._sinks:
            for port, value in sink.take():
                if node.proxy is None or not node.proxy.confirmed or sink.linked:
                    continue
                if self._send_value(node, sink, port, value) is ReturnCode.BAD_PARAMETER:
                    text = f"{node.entry.name}.{port}: {value}"
                    self.note(EventKind.VALUE_REFUSED, node.entry.id, text)

    def _send_value(self, node: ServedNode, sink: PdoSink, port: str, value: Struct) -> ReturnCode:
        if node.proxy is None or not node.proxy.confirmed or sink.linked:
            return ReturnCode.PRECONDITION_NOT_MET
        try:
            data = sink.encode(port, value)
        except (ValueError, TypeError):
            return ReturnCode.BAD_PARAMETER
        self.send(sink.layout.cob_id, data)
        return ReturnCode.RTC_OK

    def _send_heartbeat(self) -> None:
        if self.now_us >= self._heartbeat_us:
            self._heartbeat_us += 1_000 * self.definition.master.heartbeat_ms
            self._error_control(NmtState.OPERATIONAL)

    def _error_control(self, state: NmtState) -> None:
        self.send(ERROR_CONTROL_COB_ID + self.definition.master.node, bytes((state,)))

    def _command(self, command: NmtCommand, node_id: int) -> None:
        self.send(NMT_COB_ID, bytes((command, node_id)))
