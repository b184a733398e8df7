"""MPDO producer: TPDOs that name the object they carry (CiA 301, MPDO)."""

from __future__ import annotations

from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.pdo.pdo_packing import present
from tickrig.device.canopen.pdo.tpdo_modes import PdoSender, TpdoMode
from tickrig.wire.canopen.pdo import Mpdo
from tickrig.wire.instant import NEVER


class MpdoQueue(TpdoMode):
    """MPDOs: one frame an object, one frame an inhibit time, in the order of events.

    An event of an object that waits already adds no frame: the newest data are sent.
    """

    timed = True

    def __init__(self, sender: PdoSender, node_id: int = 0) -> None:
        super().__init__(sender)
        self._node_id = node_id
        self._inhibit_us, self._free_us = sender.parameters.inhibit_us, 0
        self._waiting: dict[object, bytes | Entry] = {}

    def put(self, key: object, frame: bytes | Entry) -> None:
        """Send a frame, or what an entry then holds, as soon as the inhibit time allows."""
        self._waiting[key] = frame
        self.due_us = self._free_us
        self.sender.wake(self.due_us)

    def run(self, now_us: int) -> None:
        """Send the first, or all if there is no inhibit time."""
        while self._waiting and self._free_us <= now_us:
            frame = self._waiting.pop(next(iter(self._waiting)))
            self.sender.send(frame if isinstance(frame, bytes) else self._frame_of(frame))
            self._free_us = now_us + self._inhibit_us
        self.due_us = self._free_us if self._waiting else NEVER

    def answer(self) -> None:
        """Send nothing: a remote frame cannot say which object."""

    def _frame_of(self, entry: Entry) -> bytes:
        return Mpdo(False, self._node_id, entry.index, entry.sub, present(entry)).encode()


class DamProducer(MpdoQueue):
    """MPDO in destination address mode: the application says what goes where.

    Its own mapping entry is not used.
    """

    def send_to(self, node_id: int, index: int, sub: int, data: bytes) -> None:
        """Write an object of another node, or of all with node-ID 0."""
        self.put((node_id, index, sub), Mpdo(True, node_id, index, sub, data).encode())


class SamProducer(MpdoQueue):
    """MPDO in source address mode: each change of an object of the scanner lists is sent."""

    def request(self, entry: Entry | None = None) -> None:
        """Send an object that has changed."""
        if entry is not None:
            self.put(entry.key, entry)
