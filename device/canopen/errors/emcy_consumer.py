"""EMCY consumer (CiA 301, emergency object; object 1028h)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from tickrig.device.canopen.core.cob_id_rules import cob_id_guard, is_valid
from tickrig.device.canopen.core.service import ALIVE, Handler, Service
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.cob_id import CAN_ID_MASK, INVALID
from tickrig.wire.canopen.emcy import Emcy
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.errors import FramingError

EMERGENCY_CONSUMER: Final = 0x1028
MAX_NODES: Final = 127


class EmcyConsumer(Service):
    """Hears the EMCY of other nodes: the sub-index is their node-ID.

    What to do about it is left to the application. An EMCY that has not eight
    bytes is ignored.

    Attributes:
        latest: the latest EMCY of each node since the reset.
        on_emcy: told the node-ID and the message.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.latest: dict[int, Emcy] = {}
        self.on_emcy: list[Callable[[int, Emcy], None]] = []
        self._entries = [
            entry
            for node_id in range(1, MAX_NODES + 1)
            if (entry := node.dictionary.find(EMERGENCY_CONSUMER, node_id)) is not None
        ]
        for entry in self._entries:
            entry.guard = cob_id_guard(entry, INVALID, is_valid)
            entry.watchers.append(node.rewire)

    def start(self) -> None:
        """Know nothing of others."""
        self.latest.clear()

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen in Pre-operational and Operational."""
        if state in ALIVE:
            for entry in self._entries:
                if is_valid(entry.number):
                    yield entry.number & CAN_ID_MASK, self._handler(entry.sub)

    def _handler(self, node_id: int) -> Handler:
        def receive(frame: CanFrame) -> None:
            try:
                emcy = Emcy.parse(frame.data)
            except FramingError:
                return
            self.latest[node_id] = emcy
            for told in self.on_emcy:
                told(node_id, emcy)

        return receive
