"""Reads and writes objects of the node under test, beside its checks."""

from __future__ import annotations

from tickrig.host.canopen.conform.binding.script_runner import ScriptRunner
from tickrig.host.canopen.conform.bus.exchange import Exchange
from tickrig.host.canopen.errors import SdoFailed
from tickrig.host.canopen.sdo_transfer import download
from tickrig.host.links.link import StampedFrames
from tickrig.wire.can import Frames, data_frame
from tickrig.wire.canopen.sdo.abort import AbortCode
from tickrig.wire.canopen.sdo.sdo import Abort
from tickrig.wire.canopen.sdo.sdo_command import REQUEST_COB_ID


class SdoClient(ScriptRunner):
    """The client of the default SDO server of a node.

    Args:
        exchange: the bus.
        node_id: of the node, 1..127.
    """

    def __init__(self, exchange: Exchange, node_id: int) -> None:
        super().__init__(ExchangeLink(exchange), node_id)
        self._exchange, self._request = exchange, REQUEST_COB_ID + node_id

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
        self._exchange.send(data_frame(self._request, frame))


class ExchangeLink:
    """The exchange as a `StampedLink`, with its limits, for who talks beside the checks."""

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange

    @property
    def now_us(self) -> int:
        """Bus time."""
        return self._exchange.now_us

    def send(self, traffic: Frames, /) -> None:
        """Send, when load and level allow it."""
        for frame in traffic:
            self._exchange.send(frame)

    def receive(self, timeout_us: int, /) -> Frames:
        """Return what arrives first."""
        return tuple(frame for _, frame in self.receive_stamped(timeout_us)[1])

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        """Return what arrives first, with its time."""
        return self._exchange.listen(self.now_us + timeout_us)

    def close(self) -> None:
        """Leave the bus open: it is not ours."""
