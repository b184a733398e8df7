"""A wait at a queue ends in its time, however short it is and whatever signals come."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from queue import Empty
from types import FrameType

import pytest

from tickrig.host.links.ready import WaitingQueue

TRIES = 20_000
"""SimpleQueue hangs in one of some ten thousand."""

PATIENCE_S = 60
WAIT_S, SIGNALS = 0.0005, 300


@pytest.fixture
def patience() -> Iterator[None]:
    def over(number: int, frame: FrameType | None) -> None:
        raise AssertionError("it waits for good")

    before = signal.signal(signal.SIGALRM, over)
    signal.alarm(PATIENCE_S)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.usefixtures("patience")
def test_a_wait_that_is_over_at_once_ends() -> None:
    for _ in range(TRIES):
        with pytest.raises(Empty):
            WaitingQueue[None]().get(1e-6)


@pytest.mark.usefixtures("patience")
def test_a_wait_ends_though_its_time_is_over_while_a_signal_is_handled() -> None:
    queue, handled, reader = WaitingQueue[None](), threading.Event(), threading.get_ident()

    def handle(number: int, frame: FrameType | None) -> None:
        over_s = time.monotonic() + 2 * WAIT_S
        while time.monotonic() < over_s:
            pass
        handled.set()

    def send() -> None:
        for _ in range(SIGNALS):
            signal.pthread_kill(reader, signal.SIGUSR1)
            handled.wait()
            handled.clear()

    before, sender = signal.signal(signal.SIGUSR1, handle), threading.Thread(target=send)
    sender.start()
    try:
        while sender.is_alive():
            with pytest.raises(Empty):
                queue.get(WAIT_S)
    finally:
        sender.join()
        signal.signal(signal.SIGUSR1, before)


def test_what_is_there_is_returned_in_order() -> None:
    queue = WaitingQueue[int]()
    for number in range(3):
        queue.put(number)
    assert [queue.get(wait_s) for wait_s in (0, None, 1e-6)] == [0, 1, 2]


def test_no_wait_is_none() -> None:
    with pytest.raises(Empty):
        WaitingQueue[int]().get(0)
    with pytest.raises(Empty):
        WaitingQueue[int]().get(-1)


def test_what_comes_meanwhile_ends_a_wait() -> None:
    queue = WaitingQueue[int]()
    for number, wait_s in enumerate((None, 1e30, 60)):
        thread = threading.Thread(target=queue.put, args=(number,))
        thread.start()
        assert queue.get(wait_s) == number
        thread.join()


def test_what_is_cleared_is_gone_and_what_comes_then_is_not() -> None:
    queue = WaitingQueue[int]()
    queue.put(1)
    queue.clear()
    with pytest.raises(Empty):
        queue.get(1e-6)
    queue.put(2)
    assert queue.get() == 2
