"""Reads and writes objects of the node under test, beside its checks."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from tickrig.host.canopen.conform.bus.exchange import Exchange
from tickrig.host.canopen.dialogue import Dialogue, Script
from tickrig.host.canopen.errors import SdoFailed
from tickrig.host.canopen.script_run import run_script
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.wire.can import data_frame
from tickrig.wire.canopen.sdo.abort import AbortCode
from tickrig.wire.canopen.sdo.sdo import Abort
from tickrig.wire.canopen.sdo.sdo_command import REQUEST_COB_ID

T = TypeVar("T")

SizeOf = Callable[[int, int], int]
"""Tells the bytes of an object by index and sub-index, 0 where nobody knows."""


class SdoClient:
    """The client of the default SDO server of a node, which does nothing else meanwhile.

    Frames that are no answers of the node are passed over.

    Args:
        exchange: the bus.
        node_id: of the node, 1..127.

    Attributes:
        size_of: so many bytes are taken of what the node sends without saying how many.
    """

    def __init__(self, exchange: Exchange, node_id: int) -> None:
        self._exchange, self._node_id = exchange, node_id
        self._talk = Dialogue(node_id, self._send)
        self.size_of: SizeOf = lambda index, sub: 0

    def upload(self, index: int, sub: int) -> bytes:
        """Read an object.

        Raises:
            SdoAborted: the node refuses.
            SdoTimeout: it does not answer.
            LinkClosed: the bus is gone.
        """
        return self.run(upload(index, sub, self.size_of(index, sub)))

    def download(self, index: int, sub: int, data: bytes) -> None:
        """Write an object; raises as `upload`."""
        self.run(download(index, sub, data))

    def number(self, index: int, sub: int) -> int | None:
        """Return an unsigned number, None if the node gives none."""
        try:
            return int.from_bytes(self.upload(index, sub), "little")
        except SdoFailed:
            return None

    def abort(self) -> None:
        """End a transfer that a check left open; stacks look which object the abort names."""
        frame = Abort(*self._exchange.transfer, AbortCode.GENERAL).encode()
        self._send(REQUEST_COB_ID + self._node_id, frame)

    def run(self, script: Script[T]) -> T:
        """Run a script, and return or raise what it does; LinkClosed if the bus is gone."""
        exchange, talk = self._exchange, self._talk
        for at in exchange.unanswered:  # by the check, which talks for itself
            talk.remember(at)
        try:
            return run_script(talk, self._node_id, script, exchange.now_us, exchange.listen)
        finally:
            talk.clear()
            exchange.unanswered.clear()

    def _send(self, can_id: int, data: bytes) -> None:
        self._exchange.send(data_frame(can_id, data))
