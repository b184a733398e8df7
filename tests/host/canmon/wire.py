"""A bus in this process, which what a verb sends comes out of."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count

import can

from tickrig.host.links.can_link import to_frame, to_message
from tickrig.wire.can import CanFrame

PATIENCE_S = 10
_numbers = count()


class Wire:
    """The far end of a bus of python-can's `virtual` interface."""

    def __init__(self, name: str, bus: can.BusABC) -> None:
        self.name, self._bus = name, bus

    @property
    def word(self) -> str:
        return f"virtual:{self.name}"

    def next(self) -> str:
        """Wait for a frame; an empty text if none comes."""
        message = self._bus.recv(PATIENCE_S)
        return "" if message is None else str(to_frame(message))

    def all(self) -> list[str]:
        """Return the frames that are there."""
        found = []
        while (message := self._bus.recv(0)) is not None:
            found.append(str(to_frame(message)))
        return found

    def send(self, text: str) -> None:
        self._bus.send(to_message(CanFrame.parse(text)))

    @contextmanager
    def answering(self, answer: Callable[[str], str]) -> Iterator[None]:
        """Answer each frame, where there is an answer, until the block ends."""

        def work(stop: threading.Event) -> None:
            while not stop.is_set():
                message = self._bus.recv(0.05)
                if message is not None and (text := answer(str(to_frame(message)))):
                    self.send(text)

        with _thread(work):
            yield

    @contextmanager
    def calling(self, text: str) -> Iterator[None]:
        """Send a frame again and again until the block ends."""

        def work(stop: threading.Event) -> None:
            while not stop.wait(0.01):
                self.send(text)

        with _thread(work):
            yield


@contextmanager
def _thread(work: Callable[[threading.Event], None]) -> Iterator[None]:
    stop = threading.Event()
    thread = threading.Thread(target=work, args=(stop,))
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


@contextmanager
def new_wire() -> Iterator[Wire]:
    name = f"canmon-wire-{next(_numbers)}"
    with can.Bus(interface="virtual", channel=name) as bus:
        yield Wire(name, bus)
