from __future__ import annotations

import time

import pytest

from tickrig.emulators.rig.clock import RealClock, VirtualClock


def test_virtual_time_is_never_late() -> None:
    assert VirtualClock().wait_until(10**15) == 0


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
