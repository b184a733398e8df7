"""An emulated RRC in real time, in a thread of its own."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator
from queue import Empty, SimpleQueue
from typing import TypeVar

from tickrig.device.rrc.machine import TICK_US, Rrc
from tickrig.device.rrc.settings import RrcConfig
from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.serial.emulator import Emulator, LineOutside
from tickrig.emulators.serial.network import NetworkPort, ServeUrl
from tickrig.emulators.serial.pty_port import PtyPort
from tickrig.host.control.clock import RealClock
from tickrig.host.control.requests import VERSION, Object

JOIN_S = 5.0
T = TypeVar("T")


class LiveRrc:
    """A running emulator.

    What is done to its device is done in its own thread, one thing between two
    ticks: a button that is pressed and let go is seen.
    """

    def __init__(self, outside: LineOutside, config: RrcConfig) -> None:
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
def live_rrc(outside: LineOutside, config: RrcConfig | None = None) -> Iterator[LiveRrc]:
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


@contextlib.contextmanager
def served(scheme: str) -> Iterator[NetworkPort]:
    """Serve a line to this machine, as `rfc2217` or `socket`, and give the port back."""
    with contextlib.closing(NetworkPort(ServeUrl(scheme))) as port:
        yield port
