"""What the server hears on the bus beside PDOs, and who is told."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from tickrig.host.rtc_canopen.definition.definition import SystemDefinition
from tickrig.host.rtc_canopen.events import EventKind
from tickrig.host.rtc_canopen.node.served_node import House, ServedNode
from tickrig.host.rtc_canopen.own_objects import OwnObjects
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.emcy import Emcy, EmcyCode, describe
from tickrig.wire.canopen.nmt import ALL_NODES, ERROR_CONTROL_COB_ID, NMT_COB_ID, NmtCommand
from tickrig.wire.canopen.sdo.sdo_command import REQUEST_COB_ID, RESPONSE_COB_ID
from tickrig.wire.errors import WireError

EMERGENCY: Final = range(0x081, 0x100)
SDO_RESPONSES: Final = range(0x581, 0x600)
ERROR_CONTROL: Final = range(0x701, 0x780)
QUIET_US: Final = 1_000_000
"""Another master that was not heard for so long is told of anew."""


class Receiver:
    """Tells nodes what they sent, and the log what others did.

    Args:
        nodes: by node-ID.
        definition: what the server was told.
        house: the server.
    """

    def __init__(
        self, nodes: Mapping[int, ServedNode], definition: SystemDefinition, house: House
    ) -> None:
        self._nodes, self._master_id = nodes, definition.master.node
        self._note, self._send = house.note, house.send
        self._objects = OwnObjects(definition)
        self._foreign_us: int | None = None

    def receive(self, now_us: int, at_us: int, frame: CanFrame) -> None:
        """Take a data frame that was on the bus at a time."""
        can_id, node = frame.can_id, self._nodes.get(frame.can_id & 0x7F)
        if can_id == NMT_COB_ID:
            self._hear_command(at_us, frame.data)
        elif can_id == ERROR_CONTROL_COB_ID + self._master_id:
            self._hear_master(at_us)
        elif can_id == REQUEST_COB_ID + self._master_id:
            self._hear_question(frame.data)
        elif node is None:
            return
        elif can_id in ERROR_CONTROL:
            node.hear_error_control(now_us, at_us, frame.data)
        elif can_id in SDO_RESPONSES:
            node.hear_sdo(now_us, frame.data)
        elif can_id in EMERGENCY:
            self._hear_emergency(node, frame.data)

    def _hear_command(self, at_us: int, data: bytes) -> None:
        if len(data) != 2:
            return
        command, node_id = data
        known = command in tuple(NmtCommand)
        text = NmtCommand(command).name if known else f"{command:02X}h"
        self._note(EventKind.FOREIGN_COMMAND, node_id, text if node_id else f"{text} to all")
        for node in self._nodes.values():
            if node_id in (ALL_NODES, node.entry.id):
                node.hear_foreign(at_us, command)

    def _hear_master(self, at_us: int) -> None:
        if self._foreign_us is None or at_us - self._foreign_us >= QUIET_US:
            text = "another node has the node-ID of the server"
            self._note(EventKind.FOREIGN_MASTER, self._master_id, text)
        self._foreign_us = at_us

    def _hear_question(self, data: bytes) -> None:
        if (answer := self._objects.answer(data)) is not None:
            self._send(RESPONSE_COB_ID + self._master_id, answer)

    def _hear_emergency(self, node: ServedNode, data: bytes) -> None:
        try:
            emcy = Emcy.parse(data)
        except WireError:
            return
        text = f"{emcy.code:04X}h {describe(emcy.code)}, error register {emcy.register:02X}h"
        back = emcy.code == EmcyCode.BUS_OFF_RECOVERED
        self._note(EventKind.BUS_OFF if back else EventKind.EMERGENCY, node.entry.id, text)
