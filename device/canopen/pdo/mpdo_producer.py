"""MPDO producer: TPDOs that name the object they carry (CiA 301, MPDO)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.pdo.mpdo import scanned_entries
from tickrig.device.canopen.pdo.pdo_packing import present
from tickrig.device.canopen.pdo.tpdo_modes import TpdoMode
from tickrig.wire.canopen.pdo import Mpdo
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.device.canopen.pdo.tpdo import Tpdo


class MpdoQueue(TpdoMode):
    """MPDOs: one frame an object, one frame an inhibit time, in the order of events.

    An event of an object that waits already adds no frame: the newest data are sent.
    """

    timed = True

    def __init__(self, tpdo: Tpdo) -> None:
        super().__init__(tpdo)
        self._inhibit_us, self._free_us = tpdo.parameters.inhibit_us, 0
        self._waiting: dict[object, Callable[[], bytes]] = {}

    def put(self, key: object, make: Callable[[], bytes]) -> None:
        """Send what `make` returns as soon as the inhibit time allows."""
        self._waiting[key] = make
        self.due_us = self._free_us
        self.tpdo.producer.wake(self.due_us)

    def run(self, now_us: int) -> None:
        """Send the first, or all if there is no inhibit time."""
        while self._waiting and self._free_us <= now_us:
            make = self._waiting.pop(next(iter(self._waiting)))
            self.tpdo.send(make())
            self._free_us = now_us + self._inhibit_us
        self.due_us = self._free_us if self._waiting else NEVER

    def answer(self) -> None:
        """Send nothing: a remote frame cannot say which object."""


class DamProducer(MpdoQueue):
    """MPDO in destination address mode: the application says what goes where.

    Its own mapping entry is not used.
    """

    def send_to(self, node_id: int, index: int, sub: int, data: bytes) -> None:
        """Write an object of another node, or of all with node-ID 0."""
        frame = Mpdo(True, node_id, index, sub, data).encode()
        self.put((node_id, index, sub), lambda: frame)


class SamProducer(MpdoQueue):
    """MPDO in source address mode: each change of an object of the scanner lists is sent."""

    def __init__(self, tpdo: Tpdo) -> None:
        super().__init__(tpdo)
        for entry in scanned_entries(tpdo.node.dictionary):
            tpdo.watch(entry, self._putting(entry))

    def _putting(self, entry: Entry) -> Callable[[], None]:
        node_id = self.tpdo.node.node_id

        def make() -> bytes:
            return Mpdo(False, node_id, entry.index, entry.sub, present(entry)).encode()

        return lambda: self.put(entry.key, make)
