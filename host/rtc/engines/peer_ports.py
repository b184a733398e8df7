"""Connectors of data ports to ports of peers, for any engine (OpenRTM-aist 1.x)."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import partial
from typing import Any, Final, Generic, Protocol, TypeVar

from tickrig.host.rtc.ports import connector
from tickrig.host.rtc.ports.connect import refuse_known_id
from tickrig.host.rtc.ports.data_port import DataPort, InPort, OutPort
from tickrig.host.rtc.ports.port import ConnectorProfile
from tickrig.host.rtc.ports.ring_buffer import BufferOptions, FullPolicy, RingBuffer
from tickrig.host.rtc.states import PortStatus, RtcRefused
from tickrig.host.rtc.system.call_queue import CallQueue
from tickrig.host.rtc.system.peer_thread import PeerCaller
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types.cdr import Endian, decode, encode
from tickrig.wire.rtc_types.idl import Struct

# The state of the peer of a connector.

_LOG: Final = log_of(__name__)


class PeerState(StrEnum):
    """State of a peer, as known from the latest call to the peer."""

    CONNECTED = "connected"  # it answered the latest call, or none was made
    LOST = "lost"  # the latest call had no answer


class PeerWatch:
    """Record of whether the peer of a connector (a port in another process) answers calls.

    The loss of the peer and its return are logged. One thread records the results of calls. Any
    thread may read the state.

    Args:
        who: name of the connector, for the log.

    Attributes:
        state: whether the peer answered the latest call.
        status: status that the latest call returned, or CONNECTION_LOST if it had no answer.
    """

    def __init__(self, who: str) -> None:
        self._who, self._lost_s = who, 0.0
        self.state, self.status = PeerState.CONNECTED, PortStatus.PORT_OK

    def answered(self, status: PortStatus) -> None:
        """Record an answer."""
        if self.state is PeerState.LOST:
            gone_s = time.monotonic() - self._lost_s
            _LOG.warning("%s: the peer answers again, after %.1f s", self._who, gone_s)
        self.state, self.status = PeerState.CONNECTED, status

    def unanswered(self, error: Exception) -> None:
        """Record that a call had no answer, with the reason."""
        if self.state is PeerState.CONNECTED:
            reason = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
            _LOG.warning("%s: the peer does not answer: %s", self._who, reason)
            self._lost_s = time.monotonic()
        self.state, self.status = PeerState.LOST, PortStatus.CONNECTION_LOST


T = TypeVar("T", bound=Struct)
P = TypeVar("P")

_SEND_LENGTH: Final = "64"
"""Default number of values that wait for a peer."""


@dataclass(frozen=True, slots=True)
class Codec(Generic[T, P]):
    """Pair of functions that convert values for the transfer to another process, and back.

    The converted form is bytes, or a message object of the middleware (such as ROS 2).

    Attributes:
        encode: function that converts a value for the transfer. It raises ValueError if that is not
            possible.
        decode: function that converts bytes or a message back to a value. It raises ValueError if
            that is not possible.
    """

    encode: Callable[[T], P]
    decode: Callable[[P], T]


def cdr(data_type: type[T], endian: Endian = Endian.LITTLE) -> Codec[T, bytes]:
    """Return the codec for plain CDR."""
    return Codec(partial(encode, endian=endian), partial(decode, data_type, endian=endian))


@dataclass(frozen=True, slots=True)
class PeerEnd:
    """Settings of a connector to a port in another process, on which both processes agree.

    Attributes:
        port: name of the port in the other process, such as `other/ConsoleOut0.rtc:in`.
        connector_id: ID that is unique in this system.
        properties: properties of the connector. `ConnectorOptions.parse` describes the properties
            `dataport.*`. The connector's profile contains these and all other properties.
        name: name of the connector for display. By default, it is the ID.
    """

    port: str
    connector_id: str
    properties: Mapping[str, str] = field(default_factory=dict)
    name: str = ""

    @property
    def options(self) -> connector.ConnectorOptions:
        """Options of the connector, read from its properties.

        RtcRefused is raised if a property has an invalid value.
        """
        lengths = {"dataport.buffer.length", "dataport.outport.buffer.length"}
        if lengths.isdisjoint(self.properties):
            return connector.ConnectorOptions.parse(
                {**self.properties, "dataport.outport.buffer.length": _SEND_LENGTH}
            )
        return connector.ConnectorOptions.parse(self.properties)

    def profile(self, port: DataPort[Any]) -> ConnectorProfile:
        """Return the profile of the connector between a given local port and the other process.

        Raises:
            RtcRefused: the port already has a connector with the ID `connector_id`.
        """
        refuse_known_id(port, self.connector_id)
        data_type = {"dataport.data_type": port.data_type.idl_id()}
        properties = {**data_type, **self.options.stated, **self.properties}
        ends = (port.full_name, self.port)
        if isinstance(port, InPort):
            ends = (self.port, port.full_name)
        return ConnectorProfile(self.name or self.connector_id, self.connector_id, ends, properties)


# Buffers between the thread of a manager and those of an engine.


class _LockedBuffer(RingBuffer[P]):
    """A ring buffer that one thread fills and another one reads."""

    __slots__ = ("_lock",)

    def __init__(self, options: BufferOptions) -> None:
        super().__init__(options)
        self._lock = threading.Lock()

    def write(self, value: P) -> PortStatus:
        """Add a value at the end; see `RingBuffer.write`."""
        with self._lock:
            return super().write(value)

    def read(self) -> P | None:
        """Take a value; see `RingBuffer.read`."""
        with self._lock:
            return super().read()


class _ArrivalBuffer(RingBuffer[P]):
    """A ring buffer whose values come from other threads and wait until they are admitted.

    Waiting values count as if they were in the buffer, so the status of a value is known at once.
    """

    __slots__ = ("_arrived", "_lock")

    def __init__(self, options: BufferOptions) -> None:
        super().__init__(options)
        self._lock, self._arrived = threading.Lock(), deque[P](maxlen=options.length)

    def arrive(self, value: P) -> tuple[PortStatus, bool]:
        """Add a value that waits until the manager's thread moves it into the buffer.

        Any thread may call.

        Returns:
            The first value is the status that `write` would return. The second value is True if the
            added value is the only waiting value. In this case the caller must make the manager's
            thread call `let_in`.
        """
        options = self._options
        with self._lock:
            waiting = len(self._arrived) + len(self._values)
            if waiting >= options.length and options.full is not FullPolicy.OVERWRITE:
                blocks = options.full is FullPolicy.BLOCK
                return (PortStatus.BUFFER_TIMEOUT if blocks else PortStatus.BUFFER_FULL), False
            self._arrived.append(value)
            return PortStatus.PORT_OK, len(self._arrived) == 1

    def let_in(self) -> None:
        """Move waiting values into the buffer, in the thread of the manager."""
        with self._lock:
            for value in self._arrived:
                self.write(value)
            self._arrived.clear()


class _SendBuffer(RingBuffer[P]):
    """A ring buffer that one thread fills and another one empties.

    Args:
        options: settings with the length of the buffer, and the policy for a full buffer.
        wake: function that is called when there are values to take. After that, `take` is called
            until the buffer is empty.

    Attributes:
        dropped: number of values that were lost because the buffer was full.
    """

    __slots__ = ("_lock", "_wake", "_woken", "dropped")

    def __init__(self, options: BufferOptions, wake: Callable[[], object]) -> None:
        super().__init__(options)
        self._lock, self._wake, self._woken, self.dropped = threading.Lock(), wake, False, 0

    def write(self, value: P) -> PortStatus:
        """Add a value at the end; see `RingBuffer.write`."""
        with self._lock:
            self.dropped += len(self._values) == self._options.length
            status = super().write(value)
            wakes, self._woken = not self._woken, True
        if wakes:
            self._wake()
        return status

    def take(self) -> tuple[P, ...]:
        """Remove the oldest value. Return it in a tuple, which is empty if there is no value."""
        with self._lock:
            taken = self.pop()
            self._woken = bool(taken)
        return taken

    def put_back(self, value: P) -> None:
        """Put an unsent value back at the front of the buffer.

        If the buffer is full, one value is lost. With the policy OVERWRITE, this is the unsent
        value. With another policy, it is the newest value in the buffer.
        """
        with self._lock:
            full = len(self._values) == self._options.length
            self.dropped += full
            if full and self._options.full is FullPolicy.OVERWRITE:
                return
            if full:
                self._values.pop()
            self._values.appendleft(value)


# An InPort of ours: the peer pushes, or is pulled from.

_P_co = TypeVar("_P_co", covariant=True)


class _OutPortConsumer(Protocol[_P_co]):
    """An OutPort of a peer, as an engine reaches it (OpenRTM-aist 1.x, OutPortConsumer)."""

    def get(self) -> _P_co | None:
        """Fetch the next value of the port in the other process, or return None.

        The result is None if the port has no value. The call may wait up to a time-out. Any
        exception means that the other process did not answer.
        """
        ...


class _InPortConnector(connector.Connector[T], Generic[T, P]):
    """A connector that decodes values from a peer.

    The first value that cannot be decoded is logged.
    """

    def __init__(self, port: InPort[T], end: PeerEnd, codec: Codec[T, P], calls: CallQueue) -> None:
        push, flush = connector.DataflowType.PUSH, connector.SubscriptionType.FLUSH
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
    """Connector of a local InPort into which another process pushes values.

    Args:
        port: local InPort.
        end: settings on which both processes agree.
        codec: codec that decodes the values.
        calls: queue that runs calls in the manager's thread.
        post: function that schedules a call in that thread before the next tick. If it is None,
            each value wakes up the thread instead.

    Raises:
        RtcRefused: the port has a connector with this ID, or a property is invalid.
    """

    buffer: _ArrivalBuffer[T]

    def __init__(
        self,
        port: InPort[T],
        end: PeerEnd,
        codec: Codec[T, P],
        calls: CallQueue,
        post: Callable[[Callable[[], object]], object] | None = None,
    ) -> None:
        super().__init__(port, end, codec, calls)
        self.buffer, self._post = _ArrivalBuffer(end.options.inport), post or calls.post

    def put(self, payload: P) -> PortStatus:
        """Process a value that another process has pushed.

        The InPort can read the value from the next tick on. Any thread may call this method, which
        does not wait for the manager's thread.

        Returns:
            PORT_OK, or another status of the buffer. The result is INVALID_ARGS if the value cannot
            be decoded, and CONNECTION_LOST after the end of the connector.
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


class _PulledBuffer(RingBuffer[T]):
    """A ring buffer that requests more values as soon as it is empty.

    Args:
        options: settings of the buffer.
        request: function that is called on each read of the empty buffer, and after the last value
            was read.
    """

    __slots__ = ("_request",)

    def __init__(self, options: BufferOptions, request: Callable[[], object]) -> None:
        super().__init__(options)
        self._request = request

    @property
    def readable(self) -> bool:
        """Whether `read` finds a new value.

        If there is no new value, reading this property also requests one from the other process.
        """
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
    """Connector of a local InPort that fetches (pulls) values from an OutPort in another process.

    Reading the InPort, or checking it for new values, does not wait. It only requests the next
    value, which a separate thread fetches. One value is fetched at a time. Therefore a value is as
    old as the previous reading.

    Args:
        port: local InPort.
        end: settings on which both processes agree.
        codec: codec that decodes the values.
        consumer: client for the OutPort in the other process.
        thread: thread that makes the calls.
        calls: queue that runs calls in the manager's thread.

    Raises:
        RtcRefused: the port has a connector with this ID, or a property is invalid.
    """

    def __init__(  # noqa: PLR0913, PLR0917 - as many as a connector has parts
        self,
        port: InPort[T],
        end: PeerEnd,
        codec: Codec[T, P],
        consumer: _OutPortConsumer[P],
        thread: PeerCaller,
        calls: CallQueue,
    ) -> None:
        super().__init__(port, end, codec, calls)
        self.buffer = _PulledBuffer(end.options.inport, self._request)
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
        """Get a value in the thread of the peer."""
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


# An OutPort of ours: the peer is pushed to, or pulls.

_P_contra = TypeVar("_P_contra", contravariant=True)


class _InPortConsumer(Protocol[_P_contra]):
    """An InPort of a peer, as an engine reaches it (OpenRTM-aist 1.x, InPortConsumer)."""

    def put(self, payload: _P_contra, /) -> PortStatus:
        """Send a value to the port in the other process, and return the status that it reports.

        The call may wait up to a time-out. Any exception means that there was no answer.
        """
        ...


class OutPortPushConnector(connector.Connector[Any], Generic[T, P]):
    """Connector of a local OutPort that pushes values to an InPort in another process, in a thread.

    `write` encodes values and buffers them. It does not block. If the other process does not
    answer, the value is sent again after the thread's `retry_s`. Until then, the policy of the
    buffer applies.

    Args:
        port: local OutPort.
        end: settings on which both processes agree.
        codec: codec that encodes the values.
        consumer: client for the InPort in the other process.
        thread: thread that makes the calls.

    Attributes:
        buffer: buffer of values that wait to be sent. Its `dropped` counts lost values.
        sent: number of values that the other process accepted.
        refused: number of values that the other process refused, for example with a full buffer.

    Raises:
        RtcRefused: the port has a connector with this ID, or a property is invalid.
    """

    buffer: _SendBuffer[P]

    def __init__(
        self,
        port: OutPort[T],
        end: PeerEnd,
        codec: Codec[T, P],
        consumer: _InPortConsumer[P],
        thread: PeerCaller,
    ) -> None:
        options = replace(end.options, dataflow=connector.DataflowType.PUSH)
        super().__init__(end.profile(port), (port,), options)
        self.buffer = _SendBuffer(options.outport, partial(thread.submit, self._send))
        self._codec, self._consumer, self._thread = codec, consumer, thread
        self._watch = PeerWatch(f"{port.full_name} to {end.port}")
        self.sent = self.refused = 0

    @property
    def state(self) -> PeerState:
        """Whether the peer answers."""
        return self._watch.state

    def write(self, value: T) -> PortStatus:
        """Encode a value that the OutPort writes, and put it into the buffer of values to send.

        The value is sent later.

        Returns:
            INVALID_ARGS if the value cannot be encoded. The status of the buffer if the buffer does
            not accept the value. Otherwise, the status of an earlier value, because this value is
            not sent yet: the status that the other process returned for the value sent last, such
            as PORT_OK or BUFFER_FULL, or CONNECTION_LOST if the other process did not answer.
        """
        try:
            payload = self._codec.encode(value)
        except ValueError:
            return PortStatus.INVALID_ARGS
        return (self._publisher or self.buffer).write(payload) or self._watch.status

    def _send(self) -> float | None:
        """Put the oldest value in the thread of the peer."""
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


class OutPortPullConnector(connector.Connector[Any], Generic[T, P]):
    """Connector of a local OutPort that keeps values until another process fetches (pulls) them.

    Args:
        port: local OutPort.
        end: settings on which both processes agree.
        codec: codec that encodes the values.

    Raises:
        RtcRefused: the port has a connector with this ID, or a property is invalid.
    """

    buffer: _LockedBuffer[P]

    def __init__(self, port: OutPort[T], end: PeerEnd, codec: Codec[T, P]) -> None:
        options = replace(end.options, dataflow=connector.DataflowType.PULL)
        super().__init__(end.profile(port), (port,), options)
        self.buffer, self._codec = _LockedBuffer(options.outport), codec

    def write(self, value: T) -> PortStatus:
        """Take a value from the OutPort. Return INVALID_ARGS if it cannot be encoded."""
        try:
            payload = self._codec.encode(value)
        except ValueError:
            return PortStatus.INVALID_ARGS
        return self.buffer.write(payload)

    def get(self) -> tuple[PortStatus, P | None]:
        """Remove the next value from the buffer and return it.

        This process calls the method when the other process fetches a value. Any thread may call.

        Returns:
            A status and the encoded value. The status is PORT_OK if there is a value, BUFFER_EMPTY
            if the buffer is empty, and CONNECTION_LOST if the connector has been removed. Unless
            the status is PORT_OK, the value is None.
        """
        if not self.joined:
            return PortStatus.CONNECTION_LOST, None
        payload = self.buffer.read()
        return (PortStatus.BUFFER_EMPTY if payload is None else PortStatus.PORT_OK), payload
