"""Reads and writes objects of the node under test, beside its checks."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Final, TypeVar

from tickrig.host.canopen.conform.bus.exchange import Exchange
from tickrig.host.canopen.dialogue import Dialogue, Script
from tickrig.host.canopen.errors import SdoFailed, SdoTimeout
from tickrig.host.canopen.script_run import run_script
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.wire.can import data_frame
from tickrig.wire.canopen.sdo.abort import AbortCode
from tickrig.wire.canopen.sdo.sdo import Abort
from tickrig.wire.canopen.sdo.sdo_command import REQUEST_COB_ID, RESPONSE_COB_ID, index_sub

T = TypeVar("T")

SizeOf = Callable[[int, int], int]
"""Tells the bytes of an object by index and sub-index, 0 where nobody knows."""


NUMBER_BYTES: Final = range(1, 5)
"""No number that the tester asks for is longer; a node may send anything."""
MOST_MISNAMED: Final = 20
"""So many answers that name another object are kept."""


def number_of(data: bytes) -> int | None:
    """Return an unsigned number of at most 32 bits, None if the bytes are none."""
    return int.from_bytes(data, "little") if len(data) in NUMBER_BYTES else None


class SdoClient:
    """The client of the default SDO server of a node, which does nothing else meanwhile.

    Frames that are no answers of the node are passed over.

    Args:
        exchange: the bus.
        node_id: of the node, 1..127.

    Attributes:
        misnamed: answers that name another object than the one that was asked for, one a line.
        size_of: so many bytes are taken of what the node sends without saying how many.
    """

    def __init__(self, exchange: Exchange, node_id: int) -> None:
        self._exchange, self._node_id = exchange, node_id
        self._talk = Dialogue(node_id, self._send, on_misnamed=self._keep_misnamed)
        self.misnamed: dict[str, None] = {}
        self.size_of: SizeOf = lambda index, sub: 0

    def upload(self, index: int, sub: int) -> bytes:
        """Read an object; a request that is not answered is sent once more.

        Raises:
            SdoAborted: the node refuses.
            SdoTimeout: it does not answer.
            SdoMisnamed: it answers, and names another object.
            LinkClosed: the bus is gone.
        """
        return self._twice(lambda: upload(index, sub, self.size_of(index, sub)))

    def download(self, index: int, sub: int, data: bytes) -> None:
        """Write an object, as `upload` reads one; raises the same."""
        self._twice(lambda: download(index, sub, data))

    def number(self, index: int, sub: int) -> int | None:
        """Return an unsigned number of at most 32 bits, None if the node gives none."""
        try:
            return number_of(self.upload(index, sub))
        except SdoFailed:
            return None

    def _twice(self, make: Callable[[], Script[T]]) -> T:
        """Run a script, and once more if the node did not answer: one frame may be lost."""
        with suppress(SdoTimeout):
            return self.run(make())
        return self.run(make())

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

    def _keep_misnamed(self, at: tuple[int, int], data: bytes) -> None:
        """Keep an answer that names another object."""
        asked, named = (f"{index:04X}h:{sub:02X}" for index, sub in (at, index_sub(data)))
        frame = data_frame(RESPONSE_COB_ID + self._node_id, data)
        if len(self.misnamed) < MOST_MISNAMED:
            self.misnamed[f"{asked} was answered with {frame}, which names {named}"] = None

    def _send(self, can_id: int, data: bytes) -> None:
        self._exchange.send(data_frame(can_id, data))
