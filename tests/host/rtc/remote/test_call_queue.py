"""Calls of other threads, made in the thread of the manager."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import pytest

from tickrig.host.control.client import ControlClient
from tickrig.host.control.clock import ServingClock
from tickrig.host.control.requests import RequestDispatcher
from tickrig.host.control.server import ControlServer
from tickrig.host.rtc import Manager, RtcRefused
from tickrig.host.rtc.system.call_queue import CallQueue
from tickrig.host.rtc.system.schedule import RealTime

DEADLINE_US = 30_000_000


@pytest.fixture
def calls() -> Iterator[CallQueue]:
    queue = CallQueue()
    yield queue
    queue.close()


@pytest.fixture
def others() -> Iterator[ThreadPoolExecutor]:
    with ThreadPoolExecutor(4) as pool:
        yield pool


def serve_until(calls: CallQueue, *futures: Future[object]) -> None:
    while not all(future.done() for future in futures):
        calls.serve(1_000)


def test_a_call_is_made_in_the_thread_that_serves(
    calls: CallQueue, others: ThreadPoolExecutor
) -> None:
    futures: list[Future[object]] = [
        others.submit(calls.call, threading.get_ident, DEADLINE_US) for _ in range(20)
    ]
    serve_until(calls, *futures)
    assert {future.result() for future in futures} == {threading.get_ident()}


def test_in_that_thread_itself_it_is_made_at_once(calls: CallQueue) -> None:
    assert calls.call(lambda: 5, 0) == 5


def test_what_a_call_raises_goes_to_its_caller(
    calls: CallQueue, others: ThreadPoolExecutor
) -> None:
    def fail() -> object:
        raise TimeoutError("own")

    future: Future[object] = others.submit(calls.call, fail, DEADLINE_US)
    serve_until(calls, future)
    with pytest.raises(TimeoutError, match="own"):
        future.result()


def test_what_is_posted_is_made_in_order_and_may_raise(
    calls: CallQueue, caplog: pytest.LogCaptureFixture
) -> None:
    seen: list[int] = []
    for call in (lambda: seen.append(1), lambda: 1 / 0, lambda: seen.append(2)):
        calls.post(call)
    assert seen == []
    calls.serve(0)
    assert seen == [1, 2]
    assert [record.getMessage() for record in caplog.records] == [
        "a call from another thread raised"
    ]


def test_a_call_that_does_not_begin_in_time_is_never_made(
    calls: CallQueue, others: ThreadPoolExecutor
) -> None:
    seen: list[int] = []
    future = others.submit(calls.call, lambda: seen.append(1), 1_000)
    with pytest.raises(TimeoutError, match=r"did not begin the call within 0\.001 s"):
        future.result()
    calls.serve(0)
    assert seen == []


def test_what_comes_meanwhile_waits_for_the_next_time(calls: CallQueue) -> None:
    seen: list[int] = []

    def again() -> None:
        seen.append(len(seen))
        calls.post(again)

    calls.post(again)
    calls.make()
    calls.make()
    assert seen == [0, 1]


def test_a_system_that_has_ended_refuses(calls: CallQueue, others: ThreadPoolExecutor) -> None:
    future: Future[object] = others.submit(calls.call, int, DEADLINE_US)
    while not calls._entries:
        pass
    calls.close()
    calls.close()
    with pytest.raises(RtcRefused, match="the system has ended"):
        future.result()
    with pytest.raises(RtcRefused, match="the system has ended"):
        calls.post(int)


def test_a_signal_in_a_call_ends_the_run_and_frees_the_caller(
    calls: CallQueue, others: ThreadPoolExecutor
) -> None:
    def interrupted() -> object:
        raise KeyboardInterrupt

    future: Future[object] = others.submit(calls.call, interrupted, DEADLINE_US)
    with pytest.raises(KeyboardInterrupt):
        serve_until(calls, future)
    assert isinstance(future.exception(), KeyboardInterrupt)


@pytest.mark.realtime
def test_a_clock_that_serves_makes_calls_while_it_waits(
    calls: CallQueue, others: ThreadPoolExecutor
) -> None:
    clock = ServingClock()
    clock.serve = calls.serve
    runner = RealTime(Manager(), clock)
    future = others.submit(calls.call, runner.stop, DEADLINE_US)
    runner.run()
    assert future.result() is None


@pytest.mark.realtime
def test_a_control_socket_and_calls_are_served_by_one_clock(
    calls: CallQueue, others: ThreadPoolExecutor, tmp_path: Path
) -> None:
    clock = ServingClock()
    runner = RealTime(Manager(), clock)
    server = ControlServer(tmp_path / "rtc", RequestDispatcher({"status": (lambda r: {}, ())}))
    server.attach(calls, calls.make)
    clock.serve = server.serve

    def use() -> object:
        with ControlClient(tmp_path / "rtc") as client:
            answer = client.request("status")
            calls.call(runner.stop, DEADLINE_US)
            return answer

    future = others.submit(use)
    runner.run()
    server.close()
    assert future.result() == {"v": 1, "ok": True}
