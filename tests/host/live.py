"""An emulated RRC in real time, in a thread of its own."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable, Iterator
from queue import Empty, SimpleQueue
from typing import TypeVar

import serial
from serial.rfc2217 import PortManager

from tickrig.device.rrc.config import RrcConfig
from tickrig.device.rrc.machine import TICK_US, Rrc
from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.serial.emulator import Emulator, Outside
from tickrig.emulators.serial.pty_port import PtyPort
from tickrig.host.control.clock import RealClock
from tickrig.host.control.requests import VERSION, Object
from tickrig.wire.instant import NEVER

JOIN_S = 5.0
T = TypeVar("T")


class LiveRrc:
    """A running emulator.

    What is done to its device is done in its own thread, one thing between two
    ticks: a button that is pressed and let go is seen.
    """

    def __init__(self, outside: Outside, config: RrcConfig) -> None:
        self._rrc = Rrc(config)
        self._emulator = Emulator("rrc", self._rrc, outside=outside, clock=RealClock())
        self._control = EmulatorControl(self._emulator)
        self._calls: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def set(self, name: str, value: int) -> None:
        """Set an input."""
        self._ask(lambda: self._rrc.inputs.set(name, value))

    def move_stick(self, v_pct: int, w_pct: int) -> None:
        """Set both axes of the stick between the same two ticks."""

        def move() -> None:
            self._rrc.inputs.set("stick_v_pct", v_pct)
            self._rrc.inputs.set("stick_w_pct", w_pct)

        self._ask(move)

    def read(self, name: str) -> int | str:
        """Read an output."""
        return self._ask(lambda: self._rrc.read(name))

    def ask(self, do: str, **fields: object) -> Object:
        """Make a request as to its control socket."""
        return self._ask(lambda: self._control.answer({"v": VERSION, "do": do, **fields}))

    def await_output(self, name: str, value: int | str) -> None:
        """Wait until an output has a value; looks once a tick, for 10 s."""
        for _ in range(1_000):
            if (present := self.read(name)) == value:
                return
        raise AssertionError(f"{name} is {present!r}, not {value!r}")

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        self._stop.set()
        self._thread.join(JOIN_S)
        assert not self._thread.is_alive()

    def _ask(self, question: Callable[[], T]) -> T:
        answer: SimpleQueue[T] = SimpleQueue()
        self._calls.put(lambda: answer.put(question()))
        try:
            return answer.get(timeout=JOIN_S)
        except Empty:
            raise TimeoutError(f"no answer for {JOIN_S} s") from None

    def _run(self) -> None:
        while not self._stop.is_set():
            if not self._calls.empty():
                self._calls.get()()
            self._emulator.rig.run_for(TICK_US)


@contextlib.contextmanager
def live_rrc(outside: Outside, config: RrcConfig | None = None) -> Iterator[LiveRrc]:
    """Run an emulator for the length of a `with`."""
    live = LiveRrc(outside, config or RrcConfig())
    live.start()
    try:
        yield live
    finally:
        live.stop()


@contextlib.contextmanager
def pty() -> Iterator[PtyPort]:
    """Make a pseudo-terminal and give it back."""
    port = PtyPort()
    try:
        yield port
    finally:
        port.close()


class TcpPort:
    """A `Port[bytes]` that takes one connection on the loopback interface."""

    due_us = NEVER
    lost, host_setting = 0, ""

    def __init__(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.setblocking(False)
        self._connection: socket.socket | None = None
        self.number: int = self._listener.getsockname()[1]

    def poll(self, now_us: int, /) -> bytes:
        with contextlib.suppress(BlockingIOError):
            if self._connection is None:
                self._connection, _ = self._listener.accept()
                self._connection.setblocking(False)
                self._connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return self._connection.recv(4_096)
        return b""

    def send(self, now_us: int, traffic: bytes, /) -> None:
        if self._connection is not None:
            with contextlib.suppress(ConnectionError):  # the host hung up
                self._connection.sendall(traffic)

    def close(self) -> None:
        self._listener.close()
        if self._connection is not None:
            self._connection.close()


class Rfc2217Port(TcpPort):
    """The same behind telnet with the serial options of RFC 2217, as a serial server has it."""

    def __init__(self) -> None:
        super().__init__()
        self._settings = serial.serial_for_url("loop://", baudrate=115_200)
        # typeshed wants two pyserial ports; the manager wants one port and a writer (pyserial docs)
        self._manager = PortManager(self._settings, self)  # type: ignore[arg-type]

    def write(self, data: bytes) -> None:
        """Send what the port manager answers to a negotiation."""
        super().send(0, data)

    def poll(self, now_us: int, /) -> bytes:
        return b"".join(self._manager.filter(super().poll(now_us)))

    def send(self, now_us: int, traffic: bytes, /) -> None:
        super().send(now_us, b"".join(self._manager.escape(traffic)))

    def close(self) -> None:
        self._settings.close()
        super().close()
