"""What the server hears on the bus beside PDOs, and who is told."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from tickrig.host.rtc.canopen.definition.definition import SystemDefinition
from tickrig.host.rtc.canopen.events import ServerEventType
from tickrig.host.rtc.canopen.node.served_node import NodeServer, ServedNode
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.cob_id import FLAG_30
from tickrig.wire.canopen.emcy import Emcy, EmcyCode, describe
from tickrig.wire.canopen.nmt import ALL_NODES, ERROR_CONTROL_COB_ID, NMT_COB_ID, NmtCommand
from tickrig.wire.canopen.sdo.abort import AbortCode
from tickrig.wire.canopen.sdo.sdo import (
    Abort,
    DownloadInitiateRequest,
    Request,
    UploadInitiateRequest,
    UploadInitiateResponse,
    parse_request,
)
from tickrig.wire.canopen.sdo.sdo_command import REQUEST_COB_ID, RESPONSE_COB_ID
from tickrig.wire.errors import WireError

DEVICE_TYPE: Final = 460
"""A marker of ours: the number of the profile whose text is not public."""

CONSUMERS: Final = 3
"""A heartbeat may be so many producer times late."""

SYNC_COB_ID: Final = 0x080
"""The default of 1005h (CiA 301, SYNC)."""

MOST_MS: Final = 0xFFFF

Table = Mapping[tuple[int, int], bytes]


class ServerObjects:
    """Answers who reads the server's objects by SDO.

    | object | what |
    |---|---|
    | 1000h | device type, 000001CCh |
    | 1001h | error register, 0 |
    | 1005h, 1006h | COB-ID SYNC, with bit 30 if it sends it; communication cycle period, us |
    | 1016h | consumer heartbeat time of each node |
    | 1017h | producer heartbeat time |
    | 1018h | identity: vendor-ID 0, which is nobody's |

    Not emulated: writing, segments and blocks; every object has at most four bytes.

    Args:
        definition: what the server was told.
    """

    def __init__(self, definition: SystemDefinition) -> None:
        consumed = [
            node.id << 16 | min(CONSUMERS * node.heartbeat_ms, MOST_MS) for node in definition.nodes
        ]
        sync_ms = definition.master.sync_ms
        self._table: Table = {
            (0x1000, 0): _u32(DEVICE_TYPE),
            (0x1001, 0): bytes(1),
            (0x1005, 0): _u32(SYNC_COB_ID | bool(sync_ms) * FLAG_30),
            (0x1006, 0): _u32(1_000 * sync_ms),
            **_array(0x1016, map(_u32, consumed)),
            (0x1017, 0): definition.master.heartbeat_ms.to_bytes(2, "little"),
            **_array(0x1018, [_u32(0)]),
        }
        self._indices = frozenset(index for index, _ in self._table)

    def answer(self, data: bytes) -> bytes | None:
        """Return the answer to a request; None to an abort, and to what is no request."""
        try:
            request = parse_request(data)
        except WireError:
            return None
        return None if isinstance(request, Abort) else self._answer(request)

    def _answer(self, request: Request) -> bytes:
        match request:
            case UploadInitiateRequest(index=index, sub=sub):
                return self._upload(index, sub)
            case DownloadInitiateRequest(index=index, sub=sub):
                code = self._missing(index, sub) or AbortCode.READ_ONLY
                return Abort(index, sub, code).encode()
        return Abort(0, 0, AbortCode.COMMAND_SPECIFIER).encode()

    def _upload(self, index: int, sub: int) -> bytes:
        if (code := self._missing(index, sub)) is not None:
            return Abort(index, sub, code).encode()
        value = self._table[index, sub]
        return UploadInitiateResponse(index, sub, value, len(value)).encode()

    def _missing(self, index: int, sub: int) -> AbortCode | None:
        if index not in self._indices:
            return AbortCode.NO_OBJECT
        return None if (index, sub) in self._table else AbortCode.NO_SUBINDEX


def _array(index: int, values: Iterable[bytes]) -> Table:
    """Return an array or record with its number of entries."""
    entries = list(values)
    numbered = {(index, sub): value for sub, value in enumerate(entries, 1)}
    return {(index, 0): bytes((len(entries),)), **numbered}


def _u32(value: int) -> bytes:
    return value.to_bytes(4, "little")


EMERGENCY: Final = range(0x080, 0x100)
SDO_RESPONSES: Final = range(0x580, 0x600)
ERROR_CONTROL: Final = range(0x700, 0x780)
"""What nodes send, by node-ID; node 0 is none."""

QUIET_US: Final = 1_000_000
"""Another master that was not heard for so long is told of anew."""


class FrameDispatcher:
    """Tells nodes what they sent, and the log what others did.

    Args:
        nodes: by node-ID.
        definition: what the server was told.
        server: the server.
    """

    def __init__(
        self, nodes: Mapping[int, ServedNode], definition: SystemDefinition, server: NodeServer
    ) -> None:
        self._nodes, self._master_id = nodes, definition.master.node
        self._notify, self._send = server.notify, server.send
        self._objects = ServerObjects(definition)
        self._foreign_us: int | None = None
        of_master = {ERROR_CONTROL_COB_ID + self._master_id, REQUEST_COB_ID + self._master_id}
        of_nodes = {ids[n] for ids in (EMERGENCY, SDO_RESPONSES, ERROR_CONTROL) for n in nodes}
        self._accepted = frozenset({NMT_COB_ID} | of_master | of_nodes)

    def receive(self, now_us: int, at_us: int, frame: CanFrame) -> None:
        """Take a data frame that was on the bus at a time."""
        can_id = frame.can_id
        if can_id not in self._accepted:
            return
        if can_id == NMT_COB_ID:
            self._on_nmt_command(at_us, frame.data)
        elif can_id == ERROR_CONTROL_COB_ID + self._master_id:
            self._on_master_heartbeat(at_us)
        elif can_id == REQUEST_COB_ID + self._master_id:
            self._on_sdo_request(frame.data)
        else:
            self._on_frame_of(self._nodes[can_id & 0x7F], now_us, at_us, frame)

    def _on_frame_of(self, node: ServedNode, now_us: int, at_us: int, frame: CanFrame) -> None:
        if frame.can_id in ERROR_CONTROL:
            node.on_error_control(now_us, at_us, frame.data)
        elif frame.can_id in SDO_RESPONSES:
            node.receive_sdo(now_us, frame.data)
        else:
            self._on_emergency(node, frame.data)

    def _on_nmt_command(self, at_us: int, data: bytes) -> None:
        if len(data) != 2:
            return
        command, node_id = data
        known = command in tuple(NmtCommand)
        text = NmtCommand(command).name if known else f"{command:02X}h"
        self._notify(
            ServerEventType.FOREIGN_COMMAND, node_id, text if node_id else f"{text} to all"
        )
        for node in self._nodes.values():
            if node_id in (ALL_NODES, node.entry.id):
                node.on_foreign_command(at_us, command)

    def _on_master_heartbeat(self, at_us: int) -> None:
        if self._foreign_us is None or at_us - self._foreign_us >= QUIET_US:
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
