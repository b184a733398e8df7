from __future__ import annotations

import time

import pytest

from tickrig.host.control.clock import RealClock, ServingClock


@pytest.mark.realtime
def test_a_wait_is_spent_serving_and_ends_in_time() -> None:
    clock, given = ServingClock(), list[int]()

    def serve(wait_us: int) -> None:
        given.append(wait_us)
        time.sleep(wait_us / 2e6)

    clock.wait_until(0)
    clock.serve = serve
    clock.wait_until(20_000)
    assert clock.now_us >= 20_000
    assert given[0] == 0
    assert 0 < given[1] <= 20_000
    assert given[1:] == sorted(given[1:], reverse=True)


@pytest.mark.realtime
def test_a_late_wait_serves_once_and_says_how_late_it_is() -> None:
    clock, given = ServingClock(), list[int]()
    clock.wait_until(0)
    clock.serve = given.append
    time.sleep(0.002)
    assert clock.wait_until(1_000) >= 1_000
    assert given == [0]


@pytest.mark.realtime
def test_real_time_passes() -> None:
    clock = RealClock()
    assert clock.now_us == 0
    start = time.monotonic()
    clock.wait_until(0)
    clock.wait_until(20_000)
    assert time.monotonic() - start >= 0.02
    assert clock.now_us >= 20_000


def test_a_time_that_has_passed_is_late_by_as_much(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time, "monotonic_ns", lambda: 1_000_000_000)
    clock = RealClock()
    clock.wait_until(0)
    monkeypatch.setattr(time, "monotonic_ns", lambda: 1_030_000_000)
    assert clock.wait_until(10_000) == 20_000
