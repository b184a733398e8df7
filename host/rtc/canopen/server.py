"""The RTC-CANopen server: NMT master, heartbeat consumer, and maker of proxies (Fig. 108)."""

# Theory of operation
#
# A node of the System Definition is a `ServedNode`; a node that has booted has a proxy, which is an
# ordinary RT component. The state of the proxy and the NMT state of the device are kept equal (NEDO
# report, table 3):
#
#   proxy     NMT state        requested by          on the bus it follows from
#   Inactive  Pre-operational  on_deactivated        a heartbeat with this state
#   Active    Operational      on_activated          a heartbeat with this state
#   Error     Stopped          on_aborting           a heartbeat with this state, or none in time
#
# Either side may change first. The callbacks of a proxy cannot wait for a bus. They record a
# request (`ProxyRequest`), and `_carry_out` executes it on the bus after the period, as a script of
# SDO and NMT (operations.py). A state that a heartbeat reports changes the state of the proxy. The
# heartbeat is outdated, and ignored, while a request is pending or a script that changes the state
# of the device is running. Error ends when the device was reset and has booted again: on_reset
# fails until then (`ready`).
#
# A PDO has one port, or one port per object if their types differ. An object may have a port that
# is transferred by SDO. The values of a TPDO are written to OutPorts when the frame arrives. The
# values of InPorts are sent at the end of the tick, one frame per value. From on_activated on,
# `passing` is true and data from the device pass. Data to the device pass when the script of the
# activation has ended and `confirmed` is true.
#
# The rest relies on the order within `tick`:
#
#   1. frames in the order of the bus: PDOs to ports, others to nodes;
#   2. nodes that are due: time-outs of scripts and heartbeats;
#   3. a period of the context begins: pending connections are made, components run;
#   4. requests of proxies are executed, the next node of the start order is activated;
#   5. PDOs of InPorts, SDO transfers, SYNC and the server's own heartbeat.
#
# So if a period begins in the tick in which a TPDO arrives, components read its value in this tick,
# and the tick returns their answer. `due_us` is the next due time; `wake` makes it earlier.
#
# A server that ticks too late (`_be_late`) does not know which frames the nodes sent before, so it
# must not count them as lost.

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from tickrig.host.canopen.periodic_timer import PeriodicTimer
from tickrig.host.links.link import StampedFrames
from tickrig.host.rtc.canopen.connections import PdoLinks, PortConnections
from tickrig.host.rtc.canopen.data_flow import PdoDataFlow, SdoDataFlow
from tickrig.host.rtc.canopen.definition import DeviceFile, NodeEntry, SystemDefinition
from tickrig.host.rtc.canopen.events import EventLog, ServerEventType
from tickrig.host.rtc.canopen.proxy import ProxyRtc, lay_out_sdo_ports
from tickrig.host.rtc.canopen.served_node import NodePhase, NodeServer, ServedNode
from tickrig.host.rtc.component import ExecutionContext
from tickrig.host.rtc.states import LifeCycleState, ReturnCode, RtcRefused
from tickrig.host.rtc.system.manager import Manager
from tickrig.wire.can import CanFrame, ErrorState, Frames
from tickrig.wire.canopen import nmt, sdo
from tickrig.wire.canopen.emcy import Emcy, EmcyCode, describe
from tickrig.wire.canopen.sdo_frame import REQUEST_COB_ID, RESPONSE_COB_ID, AbortCode
from tickrig.wire.errors import WireError
from tickrig.wire.instant import NEVER
from tickrig.wire.rtc_types.idl import Struct

# The frames that the server receives besides PDOs, and their receivers.

_DEVICE_TYPE: Final = 460
"""Device profile number of the server. We use a number whose profile text is not public."""

_CONSUMERS: Final = 3
"""Number of producer times by which a heartbeat may be late."""

_SYNC_COB_ID: Final = 0x080
"""Default of 1005h (CiA 301, SYNC)."""

_MOST_MS: Final = 0xFFFF

_Table = Mapping[tuple[int, int], bytes]


class ServerObjects:
    """The server's own CANopen object dictionary, which answers SDO read requests of other nodes.

    | object | what |
    |---|---|
    | 1000h | device type, 000001CCh |
    | 1001h | error register, 0 |
    | 1005h, 1006h | COB-ID SYNC (bit 30: the server sends SYNC); communication cycle period, us |
    | 1016h | consumer heartbeat time of each node |
    | 1017h | producer heartbeat time |
    | 1018h | identity: vendor-ID 0, which is not assigned |

    The server does not emulate SDO writing. Segments and blocks are not needed, because every
    object has at most four bytes.

    Args:
        definition: settings of the server.
    """

    def __init__(self, definition: SystemDefinition) -> None:
        consumed = [
            node.id << 16 | min(_CONSUMERS * node.heartbeat_ms, _MOST_MS)
            for node in definition.nodes
        ]
        sync_ms = definition.master.sync_ms
        self._table: _Table = {
            (0x1000, 0): _u32(_DEVICE_TYPE),
            (0x1001, 0): bytes(1),
            (0x1005, 0): _u32(_SYNC_COB_ID | bool(sync_ms) * nmt.FLAG_30),
            (0x1006, 0): _u32(1_000 * sync_ms),
            **_array(0x1016, map(_u32, consumed)),
            (0x1017, 0): definition.master.heartbeat_ms.to_bytes(2, "little"),
            **_array(0x1018, [_u32(0)]),
        }
        self._indices = frozenset(index for index, _ in self._table)

    def answer(self, data: bytes) -> bytes | None:
        """Return the SDO response to a request.

        If the data contain an SDO abort, or anything else that is not an SDO request, the result is
        None.
        """
        try:
            request = sdo.parse_request(data)
        except WireError:
            return None
        return None if isinstance(request, sdo.Abort) else self._answer(request)

    def _answer(self, request: sdo.Request) -> bytes:
        match request:
            case sdo.UploadInitiateRequest(index=index, sub=sub):
                return self._upload(index, sub)
            case sdo.DownloadInitiateRequest(index=index, sub=sub):
                code = self._missing(index, sub) or AbortCode.READ_ONLY
                return sdo.Abort(index, sub, code).encode()
        return sdo.Abort(0, 0, AbortCode.COMMAND_SPECIFIER).encode()

    def _upload(self, index: int, sub: int) -> bytes:
        if (code := self._missing(index, sub)) is not None:
            return sdo.Abort(index, sub, code).encode()
        value = self._table[index, sub]
        return sdo.UploadInitiateResponse(index, sub, value, len(value)).encode()

    def _missing(self, index: int, sub: int) -> AbortCode | None:
        if index not in self._indices:
            return AbortCode.NO_OBJECT
        return None if (index, sub) in self._table else AbortCode.NO_SUBINDEX


def _array(index: int, values: Iterable[bytes]) -> _Table:
    """Return an array or record with its number of entries."""
    entries = list(values)
    numbered = {(index, sub): value for sub, value in enumerate(entries, 1)}
    return {(index, 0): bytes((len(entries),)), **numbered}


def _u32(value: int) -> bytes:
    return value.to_bytes(4, "little")


_EMERGENCY: Final = range(0x080, 0x100)
_SDO_RESPONSES: Final = range(0x580, 0x600)
_ERROR_CONTROL: Final = range(0x700, 0x780)
"""CAN-IDs that nodes send, by node-ID. Node 0 does not exist."""

_QUIET_US: Final = 1_000_000
"""Time without frames after which another master is reported again."""


class _FrameDispatcher:
    """A dispatcher that passes frames to their nodes, and logs frames of other nodes.

    Args:
        nodes: nodes by node-ID.
        definition: settings of the server.
        server: server of the nodes.
    """

    def __init__(
        self, nodes: Mapping[int, ServedNode], definition: SystemDefinition, server: NodeServer
    ) -> None:
        self._nodes, self._master_id = nodes, definition.master.node
        self._notify, self._send = server.notify, server.send
        self._objects = ServerObjects(definition)
        self._foreign_us: int | None = None
        of_master = {nmt.ERROR_CONTROL_COB_ID + self._master_id, REQUEST_COB_ID + self._master_id}
        of_nodes = {ids[n] for ids in (_EMERGENCY, _SDO_RESPONSES, _ERROR_CONTROL) for n in nodes}
        self._accepted = frozenset({nmt.NMT_COB_ID} | of_master | of_nodes)

    def receive(self, now_us: int, at_us: int, frame: CanFrame) -> None:
        """Process a data frame that was on the bus at the time `at_us`."""
        can_id = frame.can_id
        if can_id not in self._accepted:
            return
        if can_id == nmt.NMT_COB_ID:
            self._on_nmt_command(at_us, frame.data)
        elif can_id == nmt.ERROR_CONTROL_COB_ID + self._master_id:
            self._on_master_heartbeat(at_us)
        elif can_id == REQUEST_COB_ID + self._master_id:
            self._on_sdo_request(frame.data)
        else:
            self._on_frame_of(self._nodes[can_id & 0x7F], now_us, at_us, frame)

    def _on_frame_of(self, node: ServedNode, now_us: int, at_us: int, frame: CanFrame) -> None:
        if frame.can_id in _ERROR_CONTROL:
            node.on_error_control(now_us, at_us, frame.data)
        elif frame.can_id in _SDO_RESPONSES:
            node.receive_sdo(now_us, frame.data)
        else:
            self._on_emergency(node, frame.data)

    def _on_nmt_command(self, at_us: int, data: bytes) -> None:
        if len(data) != 2:
            return
        command, node_id = data
        known = command in tuple(nmt.NmtCommand)
        text = nmt.NmtCommand(command).name if known else f"{command:02X}h"
        self._notify(
            ServerEventType.FOREIGN_COMMAND, node_id, text if node_id else f"{text} to all"
        )
        for node in self._nodes.values():
            if node_id in (nmt.ALL_NODES, node.entry.id):
                node.on_foreign_command(at_us, command)

    def _on_master_heartbeat(self, at_us: int) -> None:
        if self._foreign_us is None or at_us - self._foreign_us >= _QUIET_US:
            text = "another node has the node-ID of the server"
            self._notify(ServerEventType.FOREIGN_MASTER, self._master_id, text)
        self._foreign_us = at_us

    def _on_sdo_request(self, data: bytes) -> None:
        if (answer := self._objects.answer(data)) is not None:
            self._send(RESPONSE_COB_ID + self._master_id, answer)

    def _on_emergency(self, node: ServedNode, data: bytes) -> None:
        try:
            emcy = Emcy.parse(data)
        except WireError:
            return
        text = f"{emcy.code:04X}h {describe(emcy.code)}, error register {emcy.register:02X}h"
        back = emcy.code == EmcyCode.BUS_OFF_RECOVERED
        self._notify(
            ServerEventType.BUS_OFF if back else ServerEventType.EMERGENCY, node.entry.id, text
        )


_LATE_US: Final = 100_000
"""Delay of a tick from which the server does not know what the nodes sent."""


class RtcCanopenServer:
    """A server for the nodes of a System Definition.

    The server has no clock and no bus. It is driven by `tick`.

    Like the `tick` of a device, `tick` takes the time and the received frames, and returns the
    frames to send. Therefore the same server runs in virtual time on a rig, and on a real bus.

    Not emulated: flying master, TIME, program download, and a CANopen node for each proxy on the
    bus.

    Args:
        definition: System Definition to serve.
        files: content of the EDS files by name in the definition.

    Attributes:
        manager: manager of the proxies and all other components.
        nodes: nodes by node-ID.
        log: log of the events.
        connections: connectors of ports through the PC.
        links: PDO links between nodes.
        findings: findings in the EDS files.
        now_us: time of the last tick.
        due_us: time of the next call of `tick`.
    """

    def __init__(self, definition: SystemDefinition, files: Mapping[str, DeviceFile]) -> None:
        self.definition, self.manager = definition, Manager()
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
        self._receiver = _FrameDispatcher(self.nodes, definition, self)
        self._data = PdoDataFlow(self.nodes, self.send, self.notify)
        self._by_sdo = SdoDataFlow(self.nodes, self.notify)
        self._start_order = tuple(self.nodes[node_id] for node_id in definition.start_order)
        self._states: dict[int, LifeCycleState] = {}

    def tick(self, now_us: int, rx: StampedFrames, /) -> Frames:
        """Process the received frames, do all work that is due, and return the frames to send.

        Args:
            now_us: present time in us.
            rx: received frames with their times.
        """
        late_us, self.now_us = now_us - self.due_us, now_us
        if not self._started:
            self._start()
        elif late_us >= _LATE_US:
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
            self.send(_SYNC_COB_ID, b"")
        if self._heartbeat.advance(now_us):
            self._error_control(nmt.NmtState.OPERATIONAL)
        timers_us = min(self._heartbeat.due_us, self._sync.due_us)
        self.due_us = min(self._nodes_due_us, self.manager.due_us, timers_us)
        out, self._out = tuple(self._out), []
        return out

    def stop(self, now_us: int) -> Frames:
        """End all proxies and leave the nodes. Return the frames to send (K14, finalize)."""
        self.now_us = now_us
        for node in self.nodes.values():
            node.dialogue.clear()
            self.gone(node)
            self._command(nmt.NmtCommand.RESET_COMMUNICATION, node.entry.id)
            if self.definition.master.leave == "stopped":
                self._command(nmt.NmtCommand.STOP, node.entry.id)
        out, self._out = tuple(self._out), []
        return out

    def bus_state(self, state: ErrorState, /) -> None:
        """Record a report of the CAN controller. The next tick processes it."""
        self._bus_states.append(state)
        self.due_us = self.now_us

    def put(self, name: str, value: Struct) -> ReturnCode:
        """Send a value to a device, as if it had arrived at an InPort of its proxy.

        Args:
            name: full name of the InPort.
            value: value to send.

        Returns:
            RTC_OK on success, BAD_PARAMETER if there is no such port or the value does not fit, or
            PRECONDITION_NOT_MET while the proxy is not Active or if another device sends the PDO.
        """
        result = self._by_sdo.put(name, value)
        return self._data.put(name, value) if result is None else result

    def start(self) -> None:
        """Activate the nodes one after the other, in the start order of the System Definition.

        A node is activated when all nodes before it are Active. Therefore a node that does not boot
        delays all nodes after it.
        """
        for node in self._start_order:
            node.to_start = True

    def notify(self, kind: ServerEventType, node: int, text: str = "", /) -> None:
        """Record an event."""
        self.log.notify(self.now_us, kind, node, text)

    def send(self, can_id: int, data: bytes, /) -> None:
        """Send a frame with this tick's traffic."""
        self._out.append(CanFrame(can_id, data))

    def wake(self, due_us: int, /) -> None:
        """Tick the nodes at `due_us` at the latest."""
        self._nodes_due_us = min(self._nodes_due_us, due_us)
        self.due_us = min(self.due_us, due_us)

    def booted(self, node: ServedNode, /) -> None:
        """Make the proxy of a node that has booted, with its links and connections."""
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
        self._error_control(nmt.NmtState.INITIALISING)
        self._heartbeat.start(self.now_us)
        self._sync.start(self.now_us)
        for node in self.nodes.values():
            node.search(self.now_us)

    def _be_late(self, late_us: int) -> None:
        """Report the delay at most once a second. Nodes do not count as lost in that time."""
        self._late_us = max(self._late_us, late_us)
        for node in self.nodes.values():
            node.pause(self.now_us, late_us)
        if self.now_us >= self._quiet_us:
            self.notify(ServerEventType.SERVER_LATE, 0, f"looked {self._late_us // 1_000} ms late")
            self._quiet_us, self._late_us = self.now_us + _QUIET_US, 0

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
        """Process reports of the CAN controller. Bus-off leaves all proxies in Error."""
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
        """Activate the next node of the start order, if it should start and is ready."""
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

    def _error_control(self, state: nmt.NmtState) -> None:
        self.send(nmt.ERROR_CONTROL_COB_ID + self.definition.master.node, bytes((state,)))

    def _command(self, command: nmt.NmtCommand, node_id: int) -> None:
        self.send(nmt.NMT_COB_ID, bytes((command, node_id)))
