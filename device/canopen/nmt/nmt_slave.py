"""NMT slave: boot-up, commands, self start (CiA 301, network management)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.core.service import Handler, Service
from tickrig.device.canopen.core.slave import UNCONFIGURED
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.nmt import (
    ALL_NODES,
    ERROR_CONTROL_COB_ID,
    NMT_COB_ID,
    NmtCommand,
    NmtState,
)

NEXT_STATE: Final = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
}
"""The same from every state but Initialising (CiA 301, NMT state diagram)."""

NMT_STARTUP: Final = 0x1F80
SELF_START_MASK: Final = 0b1101
SELF_START: Final = 0b1000
"""1F80h of a slave that starts itself (CiA 302-2)."""


@mypyc_attr(allow_interpreted_subclasses=True)
class NmtSlave(Service):
    """Follows the NMT master."""

    def booted(self) -> None:
        """Send the boot-up message and enter Pre-operational, or Operational by itself."""
        if not self.node.boots():
            return
        self.node.send(ERROR_CONTROL_COB_ID + self.node.node_id, bytes([NmtState.INITIALISING]))
        self.node.enter(NmtState.PRE_OPERATIONAL)
        startup = self.node.dictionary.find(NMT_STARTUP)
        if startup is not None and startup.number & SELF_START_MASK == SELF_START:
            self.node.enter(NmtState.OPERATIONAL)

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen to the NMT master; a node without node-ID waits for LSS alone."""
        if self.node.node_id != UNCONFIGURED:
            yield NMT_COB_ID, self._receive

    def reconfigured_by(self, state: NmtState) -> Iterator[int]:
        """Name the NMT master: what it listens to follows the state."""
        return (can_id for can_id, _ in self.handlers(state))

    def _receive(self, frame: CanFrame) -> None:
        """Obey; what is not a command for this node is ignored."""
        if len(frame.data) != 2 or frame.data[1] not in (ALL_NODES, self.node.node_id):
            return
        try:
            command = NmtCommand(frame.data[0])
        except ValueError:
            return
        if self.node.admits(command):
            self._obey(command)

    def _obey(self, command: NmtCommand) -> None:
        match command:
            case NmtCommand.RESET_NODE:
                self.node.reset_node()
            case NmtCommand.RESET_COMMUNICATION:
                self.node.reset_communication()
            case _:
                self.node.enter(NEXT_STATE[command])
