"""EMCY consumer (CiA 301, emergency object; object 1028h)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Final, NamedTuple

from tickrig.device.canopen.core.cob_id_rules import check_emcy_cob_id, is_valid
from tickrig.device.canopen.core.service import ALIVE, Handler, Service
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.twin import Listeners
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.cob_id import CAN_ID_MASK
from tickrig.wire.canopen.emcy import Emcy
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.errors import FramingError

EMERGENCY_CONSUMER: Final = 0x1028
MAX_NODES: Final = 127


class EmcyConsumer(Service):
    """Consumes the EMCY of other nodes: the sub-index is their node-ID.

    What to do about it is left to the application. An EMCY that has not eight
    bytes is ignored.

    Attributes:
        latest: the latest EMCY of each node since the reset.
        on_emcy: called with the node-ID and the message.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self.latest: dict[int, Emcy] = {}
        self.on_emcy: Listeners[Callable[[int, Emcy], None]] = Listeners()
        self._entries = [
            entry
            for entry in node.dictionary.object(EMERGENCY_CONSUMER)
            if 1 <= entry.sub <= MAX_NODES
        ]
        for entry in self._entries:
            entry.guard = check_emcy_cob_id
            entry.watch(self.follow_cob_id)

    def start(self) -> None:
        """Know nothing of others."""
        self.latest.clear()

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen in Pre-operational and Operational."""
        if state in ALIVE:
            for entry in self._entries:
                if is_valid(entry.number):
                    yield entry.number & CAN_ID_MASK, _Producer(self, entry.sub).receive

    def take(self, node_id: int, emcy: Emcy) -> None:
        """Take the EMCY of a node."""
        self.latest[node_id] = emcy
        for notify in self.on_emcy:
            notify(node_id, emcy)


class _Producer(NamedTuple):
    """Another node, which may send EMCY."""

    consumer: EmcyConsumer
    node_id: int

    def receive(self, frame: CanFrame) -> None:
        with suppress(FramingError):
            self.consumer.take(self.node_id, Emcy.parse(frame.data))
