"""Which nodes are on a bus: each node-ID is asked for its device type, which changes nothing."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Final

from tickrig.host.canopen.commissioning.node_bus import NodeBus
from tickrig.host.canopen.errors import SdoFailed
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.lss import LSS_MASTER_COB_ID, LSS_SLAVE_COB_ID, LssCommand, message
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.canopen.sdo.sdo import Abort, UploadInitiateRequest, UploadInitiateResponse
from tickrig.wire.canopen.sdo.sdo import parse_response as parse
from tickrig.wire.canopen.sdo.sdo_command import REQUEST_COB_ID, RESPONSE_COB_ID
from tickrig.wire.errors import WireError

NODE_IDS: Final = range(1, 128)
DEVICE_TYPE: Final = 0x1000
DEVICE_NAME: Final = 0x1008
IDENTITY: Final = 0x1018

AT_ONCE: Final = 8
GAP_US: Final = 10_000
"""So many nodes are asked at once, then a pause: a slow bus carries other traffic as well."""


@dataclass(frozen=True, slots=True)
class NodeFound:
    """A node that answered or was heard.

    Attributes:
        node_id: 1..127.
        device_type: 1000h, None if it did not say it.
        identity: 1018h:01 to 04, as far as it has them.
        name: 1008h, empty if it has none.
        state: what it reported last, None if it reported nothing.
        answers: to one question; with two there are two nodes of this node-ID.
    """

    node_id: int
    device_type: int | None = None
    identity: tuple[int | None, ...] = ()
    name: str = ""
    state: NmtState | None = None
    answers: int = 1


@dataclass(slots=True)
class NetworkScan:
    """Asks, and says who is there; nothing on the bus is changed.

    Args:
        bus: the bus.
        wait_us: how long the last answers, and heartbeats, are waited for.

    Attributes:
        unconfigured: LSS slaves without a node-ID have answered.
    """

    bus: NodeBus
    wait_us: int
    unconfigured: bool = False
    _answers: Counter[int] = field(default_factory=Counter)
    _types: dict[int, int] = field(default_factory=dict)

    def run(self) -> list[NodeFound]:
        """Return who answered or was heard, by node-ID; LinkClosed if the bus is gone."""
        for first in range(1, 128, AT_ONCE):
            for node_id in NODE_IDS[first - 1 : first - 1 + AT_ONCE]:
                request = UploadInitiateRequest(DEVICE_TYPE, 0).encode()
                self.bus.send(REQUEST_COB_ID + node_id, request)
            self._gather(GAP_US)
        self.bus.send(LSS_MASTER_COB_ID, message(LssCommand.IDENTIFY_NON_CONFIGURED))
        self._gather(self.wait_us)
        return [self._identify(node_id) for node_id in sorted({*self._answers, *self.bus.states})]

    def _gather(self, span_us: int) -> None:
        for frame in self.bus.gather(span_us):
            if not (frame.remote or frame.extended):
                self._take(frame)

    def _take(self, frame: CanFrame) -> None:
        if frame.can_id == LSS_SLAVE_COB_ID:
            self.unconfigured |= frame.data[:1] == bytes((LssCommand.NON_CONFIGURED,))
        elif (node_id := frame.can_id - RESPONSE_COB_ID) in NODE_IDS:
            try:
                answer = parse(frame.data)
            except WireError:
                return
            match answer:
                case UploadInitiateResponse(index=0x1000, sub=0, data=bytes() as data):
                    self._answers[node_id] += 1
                    self._types[node_id] = int.from_bytes(data, "little")
                case Abort(index=0x1000, sub=0):
                    self._answers[node_id] += 1
                case _:
                    pass

    def _identify(self, node_id: int) -> NodeFound:
        """Ask a node that is there who it is; one that was only heard is not asked."""
        state = self.bus.states.get(node_id)
        if not self._answers[node_id]:
            return NodeFound(node_id, state=state, answers=0)
        identity = tuple(self._number(node_id, IDENTITY, sub) for sub in range(1, 5))
        name = self._text(node_id)
        return NodeFound(
            *(node_id, self._types.get(node_id), identity, name),
            state=self.bus.states.get(node_id),
            answers=self._answers[node_id],
        )

    def _number(self, node_id: int, index: int, sub: int) -> int | None:
        try:
            return int.from_bytes(self.bus.read(node_id, index, sub), "little")
        except SdoFailed:
            return None

    def _text(self, node_id: int) -> str:
        try:
            return self.bus.read(node_id, DEVICE_NAME, 0).rstrip(b"\0").decode("latin-1")
        except SdoFailed:
            return ""
