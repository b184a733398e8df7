"""A CAN bus for commissioning tools: sequential requests with time-outs."""

from __future__ import annotations

from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Final, TypeVar

from tickrig.host.canopen.dialogue import SDO_TIMEOUT_US, Script
from tickrig.host.canopen.errors import SdoFailed
from tickrig.host.canopen.network import NodeSession, state_of
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.host.links.link import LinkClosed, StampedFrames, StampedLink
from tickrig.wire.can import CanFrame, data_frame
from tickrig.wire.canopen.lss import LSS_MASTER_COB_ID, LSS_SLAVE_COB_ID, LssCommand, message
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID, NMT_COB_ID, NmtCommand, NmtState
from tickrig.wire.canopen.sdo import Abort, UploadInitiateRequest, UploadInitiateResponse
from tickrig.wire.canopen.sdo import parse_response as parse
from tickrig.wire.canopen.sdo_frame import REQUEST_COB_ID, RESPONSE_COB_ID, AbortCode
from tickrig.wire.errors import WireError

T = TypeVar("T")

_ERROR_CONTROL: Final = range(ERROR_CONTROL_COB_ID + 1, ERROR_CONTROL_COB_ID + 128)


class NodeBus:
    """A CAN bus on which commissioning tools send SDO requests, NMT commands and single frames.

    The requests run one after the other, in one thread. If a call is interrupted during an SDO
    transfer, for example by Ctrl-C, the transfer is aborted.

    Args:
        link: connection to the bus.
        timeout_us: time to wait for an SDO response, in microseconds.

    Attributes:
        states: last NMT state that each node has reported, by node-ID. A boot-up message also
            counts.
    """

    def __init__(self, link: StampedLink, timeout_us: int = SDO_TIMEOUT_US) -> None:
        self._link, self._timeout_us = link, timeout_us
        self._sessions: dict[int, NodeSession] = {}
        self.states: dict[int, NmtState] = {}

    @property
    def now_us(self) -> int:
        """Time of the bus in microseconds."""
        return self._link.now_us

    def send(self, can_id: int, data: bytes) -> None:
        """Send a data frame. Raise LinkClosed if the bus is gone."""
        self._link.send((data_frame(can_id, data),))

    def listen(self, until_us: int) -> tuple[int, StampedFrames]:
        """Wait for the next frames. Return the time, and all frames that have arrived by then.

        Raises:
            LinkClosed: the connection to the bus is lost.
        """
        now_us, frames = self._link.receive_stamped(max(0, until_us - self._link.now_us))
        for _, frame in frames:
            reports = frame.can_id in _ERROR_CONTROL and not (frame.remote or frame.extended)
            if reports and (state := state_of(frame)) is not None:
                self.states[frame.can_id - ERROR_CONTROL_COB_ID] = state
        return now_us, frames

    def gather(self, span_us: int) -> list[CanFrame]:
        """Wait for this time. Return the frames that arrive."""
        until_us, found = self.now_us + span_us, list[CanFrame]()
        now_us = self.now_us
        while now_us < until_us:
            now_us, frames = self.listen(until_us)
            found += (frame for _, frame in frames)
        return found

    def command(self, command: NmtCommand, node_id: int) -> None:
        """Send an NMT command. Node-ID 0 addresses all nodes."""
        self.send(NMT_COB_ID, bytes((command, node_id)))

    def await_state(
        self, node_id: int, wanted: tuple[NmtState, ...], within_us: int
    ) -> NmtState | None:
        """Wait until a node reports one of the wanted NMT states, or until the time limit.

        Return the last NMT state that the node reported since the call, or None if it reported
        none.
        """
        until_us, now_us = self.now_us + within_us, self.now_us
        self.states.pop(node_id, None)
        while self.states.get(node_id) not in wanted and now_us < until_us:
            now_us, _ = self.listen(until_us)
        return self.states.get(node_id)

    def run(self, node_id: int, script: Script[T], timeout_us: int = 0) -> T:
        """Run a script with a node. Return the result of the script, or raise its error.

        A script is a generator that yields SDO requests and receives their responses.

        Args:
            node_id: node-ID of the node to which the script sends its requests.
            script: script to run.
            timeout_us: time to wait for each response. A value below the default has no effect.

        Raises:
            LinkClosed: the connection to the bus is lost.
        """
        if node_id not in self._sessions:
            self._sessions[node_id] = NodeSession(node_id, self.send, self._guard)
        session = self._sessions[node_id]
        session.dialogue.sdo_timeout_us = max(timeout_us, self._timeout_us)
        try:
            return session.run(script, self.listen)
        except BaseException:
            with suppress(LinkClosed):
                session.dialogue.abort(AbortCode.GENERAL)
            raise

    def read(self, node_id: int, index: int, sub: int, size: int = 0) -> bytes:
        """Read an object of a node with an SDO upload, and return its bytes.

        Args:
            node_id: node-ID of the node.
            index: index of the object.
            sub: sub-index of the object.
            size: size of the object in bytes, or 0 if the size is unknown.

        Raises:
            SdoFailed: the node refuses the request, or does not answer.
            LinkClosed: the connection to the bus is lost.
        """
        return self.run(node_id, upload(index, sub, size))

    def write(self, node_id: int, index: int, sub: int, data: bytes, timeout_us: int = 0) -> None:
        """Write an object. The errors are those of `read`."""
        self.run(node_id, download(index, sub, data), timeout_us)

    def _guard(self, can_id: int) -> None:
        self._link.send((CanFrame(can_id, remote=True, remote_length=1),))


# The scan for nodes on a bus. It reads the device type of each node-ID and changes nothing.

_NODE_IDS: Final = range(1, 128)
_DEVICE_TYPE: Final = 0x1000
_HEARTBEAT_TIME: Final = 0x1017
_DEVICE_NAME: Final = 0x1008
_IDENTITY: Final = 0x1018

_AT_ONCE: Final = 8
_GAP_US: Final = 10_000
"""Number of nodes queried at once, and the pause after them for other traffic on a slow bus."""


@dataclass(frozen=True, slots=True)
class NodeFound:
    """A node that a network scan has found, with its identity.

    Attributes:
        node_id: node-ID of the node, 1..127.
        device_type: device type (object 1000h), or None if the node did not answer the request.
        identity: values of the identity object 1018h by sub-index, 1 to 4. A sub-index that the
            node does not have is left out.
        name: device name (object 1008h), empty if the node has none.
        state: last NMT state that the node has reported, or None if it has reported none.
        answers: number of answers to one SDO request. 2 means that two nodes share this node-ID.
        heartbeat_ms: producer heartbeat time in ms (object 1017h), or None if the node has none.
    """

    node_id: int
    device_type: int | None = None
    identity: tuple[int | None, ...] = ()
    name: str = ""
    state: NmtState | None = None
    answers: int = 1
    heartbeat_ms: int | None = None


@dataclass(slots=True)
class NetworkScan:
    """Scan that sends an SDO request to each node-ID 1..127 to find the nodes of a bus.

    The scan changes nothing on the nodes.

    Args:
        bus: bus to scan.
        wait_us: time to wait for the last answers and for heartbeats, in microseconds.

    Attributes:
        unconfigured: whether an LSS slave without a node-ID has answered.
    """

    bus: NodeBus
    wait_us: int
    unconfigured: bool = False
    _answers: Counter[int] = field(default_factory=Counter)
    _types: dict[int, int] = field(default_factory=dict)

    def run(self) -> list[NodeFound]:
        """Scan the bus. Return the nodes that answered or sent a heartbeat or boot-up, by node-ID.

        Raises:
            LinkClosed: the connection to the bus is lost.
        """
        for first in range(1, 128, _AT_ONCE):
            for node_id in _NODE_IDS[first - 1 : first - 1 + _AT_ONCE]:
                request = UploadInitiateRequest(_DEVICE_TYPE, 0).encode()
                self.bus.send(REQUEST_COB_ID + node_id, request)
            self._gather(_GAP_US)
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
        elif (node_id := frame.can_id - RESPONSE_COB_ID) in _NODE_IDS:
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
        """Read the identity of a node that answered. Skip a node that only sent a frame."""
        state = self.bus.states.get(node_id)
        if not self._answers[node_id]:
            return NodeFound(node_id, state=state, answers=0)
        identity = tuple(self._number(node_id, _IDENTITY, sub) for sub in range(1, 5))
        name = self._text(node_id)
        return NodeFound(
            *(node_id, self._types.get(node_id), identity, name),
            state=self.bus.states.get(node_id),
            answers=self._answers[node_id],
            heartbeat_ms=self._number(node_id, _HEARTBEAT_TIME, 0),
        )

    def _number(self, node_id: int, index: int, sub: int) -> int | None:
        try:
            return int.from_bytes(self.bus.read(node_id, index, sub), "little")
        except SdoFailed:
            return None

    def _text(self, node_id: int) -> str:
        try:
            return self.bus.read(node_id, _DEVICE_NAME, 0).rstrip(b"\0").decode("latin-1")
        except SdoFailed:
            return ""
