"""Calls into one peer, one after the other."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from functools import partial

import pytest

from tickrig.host.rtc.system.peer_thread import PeerThread, calls_run

DEADLINE_S = 30.0


@pytest.fixture
def thread() -> Iterator[PeerThread]:
    thread = PeerThread("peer")
    yield thread
    thread.close(10_000_000)


def finished(thread: PeerThread) -> None:
    """Return when all that was submitted was called."""
    done = threading.Event()
    thread.submit(done.set)
    assert done.wait(DEADLINE_S)


def test_calls_are_made_in_order_in_a_thread_of_their_own(thread: PeerThread) -> None:
    seen: list[tuple[int, bool]] = []
    main = threading.get_ident()

    def note(number: int) -> None:
        seen.append((number, threading.get_ident() == main))

    for number in range(3):
        thread.submit(partial(note, number))
    finished(thread)
    assert seen == [(0, False), (1, False), (2, False)]


def test_a_call_that_raises_is_logged_and_ends_nothing(
    thread: PeerThread, caplog: pytest.LogCaptureFixture
) -> None:
    thread.submit(lambda: 1 / 0)
    finished(thread)
    assert [record.getMessage() for record in caplog.records] == ["peer: a call raised"]


def test_who_has_more_to_do_lets_the_others_go_first(thread: PeerThread) -> None:
    seen, gate = list[str](), threading.Event()

    def call(name: str) -> float | None:
        gate.wait(DEADLINE_S)
        seen.append(name)
        return 0 if seen.count(name) < 3 else None

    for name in "ab":
        thread.submit(partial(call, name))
    gate.set()
    while len(seen) < 6:
        finished(thread)
    assert seen == ["a", "b", "a", "b", "a", "b"]


def test_what_is_called_again_later_does_not_hold_up_the_others(thread: PeerThread) -> None:
    seen, second = list[str](), threading.Event()

    def again() -> float | None:
        seen.append("again")
        if len(seen) == 1:
            return 0.05
        second.set()
        return None

    thread.submit(again)
    thread.submit(lambda: seen.append("other"))
    assert second.wait(DEADLINE_S)
    assert seen == ["again", "other", "again"]


def test_after_its_end_nothing_is_called() -> None:
    thread, seen = PeerThread("peer"), list[int]()
    thread.close(10_000_000)
    thread.submit(lambda: seen.append(1))
    assert seen == []


def test_a_call_that_runs_when_its_thread_is_to_end_is_known(thread: PeerThread) -> None:
    begun, end = threading.Event(), threading.Event()

    def call() -> None:
        begun.set()
        end.wait(DEADLINE_S)

    thread.submit(call)
    assert begun.wait(DEADLINE_S)
    assert not calls_run()
    thread.close()
    assert calls_run()
    end.set()
    thread.close(10_000_000)
    assert not calls_run()
