"""Connectors of an InPort with a peer: it pushes, or is pulled from (OpenRTM-aist 1.x)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Final, Generic, Protocol, TypeVar

from tickrig.host.rtc.engines.buffers import ArrivalBuffer
from tickrig.host.rtc.engines.peer_end import Codec, PeerEnd, PeerState, PeerWatch
from tickrig.host.rtc.ports.connector import Connector, DataflowType, SubscriptionType
from tickrig.host.rtc.ports.data_port import InPort
from tickrig.host.rtc.ports.ring_buffer import BufferOptions, RingBuffer
from tickrig.host.rtc.states import PortStatus, RtcRefused
from tickrig.host.rtc.system.call_queue import CallQueue
from tickrig.host.rtc.system.peer_thread import PeerCaller
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types.idl import Struct

T = TypeVar("T", bound=Struct)
P = TypeVar("P")
P_co = TypeVar("P_co", covariant=True)

_LOG: Final = log_of(__name__)


class OutPortConsumer(Protocol[P_co]):
    """An OutPort of a peer, as an engine reaches it (OpenRTM-aist 1.x, OutPortConsumer)."""

    def get(self) -> P_co | None:
        """Take the next value out of the peer's port; None if it has none.

        It may wait up to a time-out. Whatever it raises means that there was no answer.
        """
        ...


class _InPortConnector(Connector[T], Generic[T, P]):
    """Decodes what comes from a peer; the first of what cannot be decoded is logged."""

    def __init__(self, port: InPort[T], end: PeerEnd, codec: Codec[T, P], calls: CallQueue) -> None:
        push, flush = DataflowType.PUSH, SubscriptionType.FLUSH
        options = replace(end.options, dataflow=push, subscription=flush)  # the peer's matter
        super().__init__(end.profile(port), (port,), options)
        self._codec, self._calls, self._way = codec, calls, f"{end.port} to {port.full_name}"
        self._invalid = False

    def _decoded(self, payload: P) -> T | None:
        try:
            value = self._codec.decode(payload)
        except ValueError as error:
            if not self._invalid:
                _LOG.warning("%s: what came is no value: %s", self._way, error)
            self._invalid = True
            return None
        self._invalid = False
        guard = self.ports[0].guard
        return value if guard is None or guard.passes(self.ports[0], value) else None


class InPortPushConnector(_InPortConnector[T, P]):
    """Takes what a peer puts into an InPort.

    Args:
        port: of ours.
        end: what was agreed with the peer.
        codec: makes values of what passes.
        calls: those of the manager's thread.
        post: has a call made in that thread before the next tick, in its own way; else it is
            woken up for each.

    Raises:
        RtcRefused: the port has a connector of this ID, or properties that cannot be.
    """

    buffer: ArrivalBuffer[T]

    def __init__(
        self,
        port: InPort[T],
        end: PeerEnd,
        codec: Codec[T, P],
        calls: CallQueue,
        post: Callable[[Callable[[], object]], object] | None = None,
    ) -> None:
        super().__init__(port, end, codec, calls)
        self.buffer, self._post = ArrivalBuffer(end.options.inport), post or calls.post

    def put(self, payload: P) -> PortStatus:
        """Put a value into the buffer, in any thread; it is there before the next tick.

        Nothing waits for the manager's thread: that would take twice as long as the call of an
        ORB itself.

        Returns:
            PORT_OK, or what the buffer says; INVALID_ARGS if it is no value, CONNECTION_LOST
            after the end.
        """
        if (value := self._decoded(payload)) is None:
            return PortStatus.INVALID_ARGS
        if not self.joined:
            return PortStatus.CONNECTION_LOST
        status, is_first = self.buffer.arrive(value)
        try:
            if is_first:
                self._post(self.buffer.let_in)
        except RtcRefused:
            return PortStatus.CONNECTION_LOST
        return status


class PulledBuffer(RingBuffer[T]):
    """A ring buffer that asks for more as soon as it is empty.

    Args:
        options: how it behaves.
        request: called whenever somebody looks for a value that is not there, and after the
            last one was read.
    """

    __slots__ = ("_request",)

    def __init__(self, options: BufferOptions, request: Callable[[], object]) -> None:
        super().__init__(options)
        self._request = request

    @property
    def readable(self) -> bool:
        """Whether `read` finds a new value; if not, one is fetched."""
        found = len(self._values) > self._skip
        if not found:
            self._request()
        return found

    def read(self) -> T | None:
        """Take a value; see `RingBuffer.read`."""
        value = super().read()
        if len(self._values) <= self._skip:
            self._request()
        return value


class InPortPullConnector(_InPortConnector[T, P]):
    """Fetches values of a peer's OutPort, in the thread of that peer.

    Nothing waits: reading the InPort, or looking whether it has something new, has the next
    value fetched, one at a time. So a value is as old as the reading before it.

    Args:
        port: of ours.
        end: what was agreed with the peer.
        codec: makes values of what passes.
        consumer: reaches the peer's OutPort.
        thread: makes the calls.
        calls: those of the manager's thread.

    Raises:
        RtcRefused: the port has a connector of this ID, or properties that cannot be.
    """

    def __init__(  # noqa: PLR0913, PLR0917 - as many as a connector has parts
        self,
        port: InPort[T],
        end: PeerEnd,
        codec: Codec[T, P],
        consumer: OutPortConsumer[P],
        thread: PeerCaller,
        calls: CallQueue,
    ) -> None:
        super().__init__(port, end, codec, calls)
        self.buffer = PulledBuffer(end.options.inport, self._request)
        self._consumer, self._thread, self._fetching = consumer, thread, False
        self._watch = PeerWatch(self._way)

    @property
    def state(self) -> PeerState:
        """Whether the peer answers."""
        return self._watch.state

    def _request(self) -> None:
        if self.joined and not self._fetching:
            self._fetching = True
            self._thread.submit(self._fetch)

    def _fetch(self) -> float | None:
        """Get a value, in the thread of the peer."""
        if not self.joined:
            return None
        try:
            payload = self._consumer.get()
        except Exception as error:  # an ORB has errors of its own
            self._watch.unanswered(error)
            return self._thread.retry_s
        self._watch.answered(PortStatus.PORT_OK)
        value = None if payload is None else self._decoded(payload)
        try:
            self._calls.post(partial(self._deliver, value))
        except RtcRefused:  # the system has ended
            return None
        return None

    def _deliver(self, value: T | None) -> None:
        self._fetching = False
        if value is not None and self.joined:
            self.buffer.write(value)
