"""The calls of many connectors share a thread until one of them hangs."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator
from logging.handlers import QueueHandler
from queue import SimpleQueue

import pytest

from tests.host.rtc.remote.engine import DEADLINE_S
from tickrig.host.rtc.system.peer_thread import PeerThreads


@pytest.fixture
def threads() -> Iterator[PeerThreads]:
    threads = PeerThreads("peers", retry_us=1_000)
    yield threads
    threads.close()


def test_calls_that_return_at_once_share_a_thread(threads: PeerThreads) -> None:
    seen, done = list[tuple[int, int]](), threading.Event()

    def call(number: int) -> None:
        seen.append((number, threading.get_ident()))

    for number in range(200):
        threads.submit(lambda number=number: call(number))  # type: ignore[misc]
    threads.submit(done.set)
    assert done.wait(DEADLINE_S)
    assert sorted(number for number, _ in seen) == list(range(200))
    assert threads.running <= 1 + 200 // 10  # one, unless this machine was busy elsewhere


def test_who_hangs_delays_nobody(threads: PeerThreads) -> None:
    awake, hanging = threading.Event(), threading.Semaphore(0)

    def hang() -> None:
        hanging.release()
        awake.wait(DEADLINE_S)

    for _ in range(20):
        threads.submit(hang)
    for number in range(20):  # each is called although those before it hang
        while not hanging.acquire(timeout=0.01):
            threads.submit(lambda: None)
        assert threads.running > number
    done = threading.Event()
    while not done.wait(0.01):
        threads.submit(done.set)
    assert threads.running > 20
    awake.set()


def test_calls_that_come_again_and_wait_for_each_other_get_a_second_thread(
    threads: PeerThreads,
) -> None:
    seen, two = set[int](), threading.Event()

    def call() -> float | None:
        seen.add(threading.get_ident())
        if len(seen) > 1:
            two.set()
        return None if two.wait(0.001) else 0

    for _ in range(20):
        threads.submit(call)
    assert two.wait(DEADLINE_S)


def test_a_call_is_made_again_at_once_or_after_a_time(threads: PeerThreads) -> None:
    waits, done = [0.0, 0.001, 0.0, 0.002], threading.Event()

    def call() -> float | None:
        if waits:
            return waits.pop()
        done.set()
        return None

    threads.submit(call)
    assert done.wait(DEADLINE_S)


def test_a_call_that_raises_is_logged(threads: PeerThreads) -> None:
    logged = SimpleQueue[logging.LogRecord]()
    handler = QueueHandler(logged)

    def call() -> None:
        raise RuntimeError("on purpose")

    logging.getLogger().addHandler(handler)
    try:
        threads.submit(call)
        text = logged.get(timeout=DEADLINE_S).getMessage()
    finally:
        logging.getLogger().removeHandler(handler)
    assert text.startswith("peers: a call raised")


def test_at_the_end_the_threads_end() -> None:
    threads, done = PeerThreads("peers at their end"), threading.Event()
    threads.submit(done.set)
    assert done.wait(DEADLINE_S)
    mine = [one for one in threading.enumerate() if one.name == "peers at their end"]
    threads.close()
    for thread in mine:
        thread.join(DEADLINE_S)
    assert threads.running == 0
    threads.submit(done.set)  # nothing comes of it
    assert threads.running == 0
