from __future__ import annotations

import time

import pytest

from tickrig.emulators.control.serving_clock import ServingClock

pytestmark = pytest.mark.realtime


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


def test_a_late_wait_serves_once_and_says_how_late_it_is() -> None:
    clock, given = ServingClock(), list[int]()
    clock.wait_until(0)
    clock.serve = given.append
    time.sleep(0.002)
    assert clock.wait_until(1_000) >= 1_000
    assert given == [0]
