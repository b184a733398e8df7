"""A wait at a queue ends, however short it is."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from queue import Empty, SimpleQueue
from types import FrameType

import pytest

from tickrig.host.links.get_within import get_within

TRIES = 50_000
"""The queue's own `get` hangs in one of some ten thousand."""

PATIENCE_S = 60


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
            get_within(SimpleQueue[None](), 1e-6)


def test_what_is_there_is_returned_in_order() -> None:
    queue = SimpleQueue[int]()
    for number in range(3):
        queue.put(number)
    assert [get_within(queue, wait_s) for wait_s in (0, None, 1e-6)] == [0, 1, 2]


def test_no_wait_is_none() -> None:
    with pytest.raises(Empty):
        get_within(SimpleQueue[int](), 0)


def test_what_comes_meanwhile_ends_a_wait() -> None:
    queue = SimpleQueue[int]()
    thread = threading.Thread(target=queue.put, args=(7,))
    with pytest.raises(Empty):
        get_within(queue, 1e-6)
    thread.start()
    assert get_within(queue, None) == 7
    thread.join()
