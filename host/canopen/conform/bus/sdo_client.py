"""Reads and writes objects of the node under test, beside its checks."""

from __future__ import annotations

from typing import Any, Final, TypeVar

from tickrig.host.canopen.conform.bus.exchange import Exchange
from tickrig.host.canopen.dialogue import Dialogue, QueuedScript, Script
from tickrig.host.canopen.errors import SdoFailed
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.wire.can import CanFrame, data_frame
from tickrig.wire.canopen.sdo.abort import AbortCode
from tickrig.wire.canopen.sdo.sdo import Abort
from tickrig.wire.canopen.sdo.sdo_command import REQUEST_COB_ID, RESPONSE_COB_ID

T = TypeVar("T")

MOST_BYTES: Final = 64_000
"""More is read of no object: a node that never says which segment is the last has an end."""


class SdoClient:
    """The client of the default SDO server of a node.

    Args:
        exchange: the bus.
        node_id: of the node, 1..127.
    """

    def __init__(self, exchange: Exchange, node_id: int) -> None:
        self._exchange, self._node_id = exchange, node_id
        self._response = f"{RESPONSE_COB_ID + node_id:03X}"

    def upload(self, index: int, sub: int) -> bytes:
        """Read an object.

        Raises:
            SdoAborted: the node refuses.
            SdoTimeout: it does not answer.
        """
        return self._run(upload(index, sub))

    def download(self, index: int, sub: int, data: bytes) -> None:
        """Write an object; raises as `upload`."""
        self._run(download(index, sub, data))

    def number(self, index: int, sub: int) -> int | None:
        """Return an unsigned number, None if the node has none there."""
        try:
            return int.from_bytes(self.upload(index, sub), "little")
        except SdoFailed:
            return None

    def abort(self) -> None:
        """End a transfer that a check left open."""
        frame = Abort(0, 0, AbortCode.GENERAL).encode()
        self._exchange.send(data_frame(REQUEST_COB_ID + self._node_id, frame))

    def _run(self, script: Script[T]) -> T:
        ended: list[Any] = []
        exchange = self._exchange
        exchange.unread(self._response).clear()
        talk = Dialogue(self._node_id, lambda can_id, data: exchange.send(data_frame(can_id, data)))
        talk.start(exchange.now_us, QueuedScript("", script, ended.append, ended.append))
        while not ended:
            text = exchange.next(self._response, talk.due_us)
            if text is None:
                talk.tick(talk.due_us)
            else:
                talk.receive_sdo(exchange.now_us, CanFrame.parse(text).data)
        if isinstance(ended[0], Exception):
            raise ended[0]
        result: T = ended[0]
        return result
