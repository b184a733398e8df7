"""Connectors of an OutPort with a peer: it is pushed to, or it pulls (OpenRTM-aist 1.x)."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

from tickrig.host.rtc.engines.buffers import LockedBuffer, SendBuffer
from tickrig.host.rtc.engines.peer_end import Codec, PeerEnd, PeerState, PeerWatch
from tickrig.host.rtc.ports.connector import Connector, DataflowType
from tickrig.host.rtc.ports.data_port import OutPort
from tickrig.host.rtc.states import PortStatus
from tickrig.host.rtc.system.peer_thread import PeerCaller
from tickrig.wire.rtc_types.idl import Struct

T = TypeVar("T", bound=Struct)
P = TypeVar("P")
P_contra = TypeVar("P_contra", contravariant=True)


class InPortConsumer(Protocol[P_contra]):
    """An InPort of a peer, as an engine reaches it (OpenRTM-aist 1.x, InPortConsumer)."""

    def put(self, payload: P_contra, /) -> PortStatus:
        """Put a value into the peer's port, and return what it says.

        It may wait up to a time-out. Whatever it raises means that there was no answer.
        """
        ...


class OutPortPushConnector(Connector[Any], Generic[T, P]):
    """Pushes values from an OutPort to a peer, in the thread of that peer.

    `write` encodes, and puts what passes into a buffer; nothing waits. A value that the peer
    gave no answer to is put again after the time of the thread's `retry_s`, and the
    buffer's policy holds meanwhile.

    Args:
        port: of ours.
        end: what was agreed with the peer.
        codec: makes what passes.
        consumer: reaches the peer's InPort.
        thread: makes the calls.

    Attributes:
        buffer: what waits for the peer; its `dropped` counts what was lost.
        sent: values that the peer took.
        refused: values that the peer did not take, as with a full buffer.

    Raises:
        RtcRefused: the port has a connector of this ID, or properties that cannot be.
    """

    buffer: SendBuffer[P]

    def __init__(
        self,
        port: OutPort[T],
        end: PeerEnd,
        codec: Codec[T, P],
        consumer: InPortConsumer[P],
        thread: PeerCaller,
    ) -> None:
        options = replace(end.options, dataflow=DataflowType.PUSH)
        super().__init__(end.profile(port), (port,), options)
        self.buffer = SendBuffer(options.outport, partial(thread.submit, self._send))
        self._codec, self._consumer, self._thread = codec, consumer, thread
        self._watch = PeerWatch(f"{port.full_name} to {end.port}")
        self.sent = self.refused = 0

    @property
    def state(self) -> PeerState:
        """Whether the peer answers."""
        return self._watch.state

    def write(self, value: T) -> PortStatus:
        """Take a value from the OutPort.

        Returns:
            INVALID_ARGS if it cannot be encoded; what the buffer says, if that is not PORT_OK;
            else what the peer said of the latest value that it was given: PORT_OK, such as
            BUFFER_FULL, or CONNECTION_LOST if it gave no answer.
        """
        try:
            payload = self._codec.encode(value)
        except ValueError:
            return PortStatus.INVALID_ARGS
        return (self._publisher or self.buffer).write(payload) or self._watch.status

    def _send(self) -> float | None:
        """Put the oldest value, in the thread of the peer."""
        taken = self.buffer.take()
        if not taken or not self.joined:
            return None
        try:
            status = self._consumer.put(*taken)
        except Exception as error:  # an ORB has errors of its own
            self.buffer.put_back(*taken)
            self._watch.unanswered(error)
            return self._thread.retry_s
        if status is PortStatus.PORT_OK:
            self.sent += 1
        else:
            self.refused += 1
        self._watch.answered(status)
        return 0


class OutPortPullConnector(Connector[Any], Generic[T, P]):
    """Holds values of an OutPort until a peer takes them.

    Args:
        port: of ours.
        end: what was agreed with the peer.
        codec: makes what passes.

    Raises:
        RtcRefused: the port has a connector of this ID, or properties that cannot be.
    """

    buffer: LockedBuffer[P]

    def __init__(self, port: OutPort[T], end: PeerEnd, codec: Codec[T, P]) -> None:
        options = replace(end.options, dataflow=DataflowType.PULL)
        super().__init__(end.profile(port), (port,), options)
        self.buffer, self._codec = LockedBuffer(options.outport), codec

    def write(self, value: T) -> PortStatus:
        """Take a value from the OutPort; INVALID_ARGS if it cannot be encoded."""
        try:
            payload = self._codec.encode(value)
        except ValueError:
            return PortStatus.INVALID_ARGS
        return self.buffer.write(payload)

    def get(self) -> tuple[PortStatus, P | None]:
        """Take the next value, in any thread.

        Returns:
            PORT_OK and what passes; else None with BUFFER_EMPTY, or with CONNECTION_LOST after
            the end.
        """
        if not self.joined:
            return PortStatus.CONNECTION_LOST, None
        payload = self.buffer.read()
        return (PortStatus.BUFFER_EMPTY if payload is None else PortStatus.PORT_OK), payload
