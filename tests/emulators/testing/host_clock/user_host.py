"""A host as people write them: it knows nothing of any rig."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from time import monotonic
from typing import Protocol


class Port(Protocol):
    """What it uses of a `serial.Serial` with `timeout=0`."""

    def read(self, size: int = 1) -> bytes: ...

    def write(self, data: bytes) -> int | None: ...


class Host:
    """Talks to an RRC: polls the port until a line has come, or a deadline."""

    now = staticmethod(time.monotonic)
    stamp = time.time

    def __init__(self, port: Port, pause: Callable[[float], None] = time.sleep) -> None:
        self._port, self._pause, self._held = port, pause, b""
        self.lines: queue.Queue[str] = queue.Queue()

    def ask(self, command: str, timeout_s: float = 0.1) -> str:
        """Send a command; return its answer, or raise TimeoutError."""
        self._port.write(f"{command}\n".encode())
        deadline = monotonic() + timeout_s
        while monotonic() < deadline:
            if line := self.poll():
                return line
            time.sleep(0.001)
        raise TimeoutError(command)

    def spin(self, timeout_s: float) -> int:
        """Do nothing but look at the clock; return how often."""
        end, looks = self.now() + timeout_s, 0
        while self.now() < end:
            looks += 1
        return looks

    def rest(self, seconds: float) -> float:
        """Sleep, and return how long by another clock."""
        begin = time.perf_counter()
        self._pause(seconds)
        return time.perf_counter() - begin

    def poll(self) -> str:
        """Return a line that has come, if there is one."""
        self._held += self._port.read(100)
        line, end, rest = self._held.partition(b"\n")
        if not end:
            return ""
        self._held = rest
        return line.decode()


def wait_for_event(event: threading.Event, timeout_s: float | None) -> bool:
    return event.wait(timeout_s)


def nap(seconds: float, *, pause: Callable[[float], None] = time.sleep) -> None:
    pause(seconds)


def now_ns() -> tuple[int, int, int]:
    return time.time_ns(), time.monotonic_ns(), time.perf_counter_ns()


class Watchdog(threading.Thread):
    """Sleeps in a thread of its own."""

    def __init__(self) -> None:
        super().__init__(name="watchdog")
        self.error: BaseException | None = None
        self.looked = 0.0

    def run(self) -> None:
        try:
            self.looked = time.monotonic()
            time.sleep(0.01)
        except RuntimeError as error:
            self.error = error
