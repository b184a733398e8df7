"""Says scripts to a node over a link, one after the other, and waits for the end of each."""

from __future__ import annotations

from typing import TypeVar

from tickrig.host.canopen.dialogue import Dialogue, QueuedScript, Script
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.host.links.link import StampedLink
from tickrig.wire.can import data_frame
from tickrig.wire.canopen.sdo.sdo_command import RESPONSE_COB_ID

T = TypeVar("T")


class ScriptRunner:
    """The SDO client of a node, for who has nothing else to do meanwhile.

    Frames that are no answers of the node are passed over.

    Args:
        link: the bus; nobody else may read from this link.
        node_id: of the node, 1..127.
    """

    def __init__(self, link: StampedLink, node_id: int) -> None:
        self._link, self._node_id = link, node_id

    def upload(self, index: int, sub: int) -> bytes:
        """Read an object.

        Raises:
            SdoAborted: the node refuses.
            SdoTimeout: it does not answer.
            LinkClosed: the bus is gone.
        """
        return self.run(upload(index, sub))

    def download(self, index: int, sub: int, data: bytes) -> None:
        """Write an object; raises as `upload`."""
        self.run(download(index, sub, data))

    def run(self, script: Script[T]) -> T:
        """Run a script, and return or raise what it does; LinkClosed if the bus is gone."""
        ended: list[T | Exception] = []
        talk = Dialogue(self._node_id, self._send)
        talk.start(self._link.now_us, QueuedScript("", script, ended.append, ended.append))
        while not ended:
            now_us, frames = self._link.receive_stamped(talk.due_us - self._link.now_us)
            for _, frame in frames:
                if frame[:1] + frame[2:4] == (RESPONSE_COB_ID + self._node_id, False, False):
                    talk.receive_sdo(now_us, frame.data)
            talk.tick(now_us)
        if isinstance(ended[0], Exception):
            raise ended[0]
        return ended[0]

    def _send(self, can_id: int, data: bytes) -> None:
        self._link.send((data_frame(can_id, data),))
