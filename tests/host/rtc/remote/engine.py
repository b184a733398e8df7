"""A small engine: two systems in one process, joined by bytes over loopback TCP."""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from typing import Any

from tests.host.rtc.chain import PERIOD_US, make_manager
from tickrig.host.rtc import InPort, OutPort, PortStatus
from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.engines.peer_ports import (
    InPortPullConnector,
    InPortPushConnector,
    OutPortPullConnector,
    OutPortPushConnector,
    PeerEnd,
    cdr,
)
from tickrig.host.rtc.system.call_queue import CallQueue
from tickrig.host.rtc.system.peer_thread import PeerThread
from tickrig.wire.rtc_types.cdr import Endian

DEADLINE_S = 30.0
"""Far more than anything here takes."""

LENGTH = struct.Struct("!I")


class Servant:
    """Answers each message of each connection, in a thread of its own."""

    def __init__(self, answer: Callable[[bytes], bytes], port: int = 0) -> None:
        self._answer, self._open = answer, list[socket.socket]()
        self._listener = socket.create_server(("127.0.0.1", port))
        self.port: int = self._listener.getsockname()[1]
        self.awake = threading.Event()
        self.awake.set()
        threading.Thread(target=self._accept, daemon=True).start()

    def kill(self) -> None:
        """End as a killed process does: all connections are cut."""
        for connection in (self._listener, *self._open):
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
            connection.close()
        self.awake.set()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                connection, _ = self._listener.accept()
                self._open.append(connection)
                threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        with connection, contextlib.suppress(OSError):
            while True:
                message = receive(connection)
                self.awake.wait()
                send(connection, self._answer(message))


class Reference:
    """Reaches a servant; each call has a time-out, and cuts the connection if it fails."""

    def __init__(self, port: int, timeout_s: float = DEADLINE_S) -> None:
        self._port, self.timeout_s = port, timeout_s
        self._connection: socket.socket | None = None

    def request(self, message: bytes) -> bytes:
        try:
            if self._connection is None:
                self._connection = socket.create_connection(("127.0.0.1", self._port))
            self._connection.settimeout(self.timeout_s)
            send(self._connection, message)
            return receive(self._connection)
        except OSError:
            self.close()
            raise

    def close(self) -> None:
        if self._connection is not None:
            self._connection.close()
        self._connection = None

    def put(self, payload: bytes) -> PortStatus:
        return PortStatus(self.request(payload)[0])

    def get(self) -> bytes | None:
        answer = self.request(b"")
        if answer[0] == PortStatus.BUFFER_EMPTY:
            return None
        assert answer[0] == PortStatus.PORT_OK
        return answer[1:]


def send(connection: socket.socket, message: bytes) -> None:
    connection.sendall(LENGTH.pack(len(message)) + message)


def receive(connection: socket.socket) -> bytes:
    return exactly(connection, *LENGTH.unpack(exactly(connection, LENGTH.size)))


def exactly(connection: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size:
        if not (part := connection.recv(size - len(data))):
            raise ConnectionResetError("the peer hung up")
        data += part
    return data


class Engine:
    """Makes the ports of a system reachable."""

    def __init__(self, stack: ExitStack) -> None:
        self.manager, self.calls, self._stack = make_manager(), CallQueue(), stack
        self.thread = PeerThread("peer", retry_us=20_000)
        self.references: list[Reference] = []
        self.known: dict[str, RtComponent] = {}
        self.manager.on_added.append(lambda one: self.known.update({one.instance_name: one}))
        self.manager.on_removed.append(lambda one: self.known.pop(one.instance_name))
        stack.callback(self.close)

    def serve(self, answer: Callable[[bytes], bytes], port: int = 0) -> Servant:
        servant = Servant(answer, port)
        self._stack.callback(servant.kill)
        return servant

    def refer(self, servant: Servant, timeout_s: float = DEADLINE_S) -> Reference:
        self.references.append(Reference(servant.port, timeout_s))
        return self.references[-1]

    def close(self) -> None:
        self.calls.close()
        for reference in self.references:
            reference.timeout_s = 0.01
        self.thread.close(1_000_000)
        for reference in self.references:
            reference.close()

    def out_port(self, name: str) -> OutPort[Any]:
        port = self.manager.port(name)
        assert isinstance(port, OutPort)
        return port

    def in_port(self, name: str) -> InPort[Any]:
        port = self.manager.port(name)
        assert isinstance(port, InPort)
        return port

    def step(self) -> None:
        """Run one period, and make the calls that others wait for."""
        self.calls.serve(1_000)
        self.manager.run_for(PERIOD_US)


def answer_put(connector: InPortPushConnector[Any, bytes]) -> Callable[[bytes], bytes]:
    return lambda payload: bytes([connector.put(payload)])


def answer_get(connector: OutPortPullConnector[Any, bytes]) -> Callable[[bytes], bytes]:
    def answer(message: bytes) -> bytes:
        status, payload = connector.get()
        return bytes([status]) + (payload or b"")

    return answer


class Pair:
    """ConsoleIn0 of one engine and ConsoleOut0 of another one, Active; `join` joins them."""

    def __init__(self, stack: ExitStack) -> None:
        self.near, self.far = Engine(stack), Engine(stack)
        self.source: Any = self.near.manager.create("ConsoleIn")
        self.sink: Any = self.far.manager.create("ConsoleOut")
        self.near.manager.activate("ConsoleIn0")
        self.far.manager.activate("ConsoleOut0")
        self.out, self.in_ = (
            self.near.out_port("ConsoleIn0.out"),
            self.far.in_port("ConsoleOut0.in"),
        )

    @property
    def numbers(self) -> list[int]:
        """What arrived."""
        return [value.data for value in self.sink.received]

    def push(
        self,
        properties: Mapping[str, str] = {},
        endian: Endian = Endian.LITTLE,
        timeout_s: float = DEADLINE_S,
    ) -> tuple[OutPortPushConnector[Any, bytes], InPortPushConnector[Any, bytes], Servant]:
        """Join the ports so that values are pushed."""
        here, there = self._ends("push", properties)
        codec = cdr(self.out.data_type, endian)
        put_into = InPortPushConnector(self.in_, there, codec, self.far.calls)
        servant = self.far.serve(answer_put(put_into))
        reference = self.near.refer(servant, timeout_s)
        pushed = OutPortPushConnector(self.out, here, codec, reference, self.near.thread)
        put_into.begin()
        pushed.begin()
        self.near.manager.add_connector(pushed)
        return pushed, put_into, servant

    def pull(
        self, properties: Mapping[str, str] = {}, timeout_s: float = DEADLINE_S
    ) -> tuple[OutPortPullConnector[Any, bytes], InPortPullConnector[Any, bytes], Servant]:
        """Join the ports so that values are pulled."""
        here, there = self._ends("pull", properties)
        codec = cdr(self.out.data_type)
        held = OutPortPullConnector(self.out, here, codec)
        servant = self.near.serve(answer_get(held))
        reference = self.far.refer(servant, timeout_s)
        pulled = InPortPullConnector(
            self.in_, there, codec, reference, self.far.thread, self.far.calls
        )
        held.begin()
        pulled.begin()
        return held, pulled, servant

    def until(self, done: Callable[[], object]) -> None:
        """Run both systems until something is so."""
        end_s = time.monotonic() + DEADLINE_S
        while not done():
            assert time.monotonic() < end_s
            self.near.step()
            self.far.step()

    def _ends(self, dataflow: str, properties: Mapping[str, str]) -> tuple[PeerEnd, PeerEnd]:
        keys = {f"dataport.{key}": text for key, text in properties.items()}
        keys["dataport.dataflow_type"] = dataflow
        return (
            PeerEnd("far/ConsoleOut0.rtc:in", "9c1f", keys),
            PeerEnd("near/ConsoleIn0.rtc:out", "9c1f", keys),
        )


@contextmanager
def joined_systems() -> Iterator[Pair]:
    """Give two systems that are not joined yet; nothing of them is left."""
    with ExitStack() as stack:
        yield Pair(stack)
