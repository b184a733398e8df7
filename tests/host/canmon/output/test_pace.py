from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tickrig.host.canmon.output.listening import Pace


@pytest.mark.realtime
def test_a_moment_is_never_left_early() -> None:
    pace = Pace()
    for at_us in range(0, 20_000, 1_000):
        late_us = pace.wait_until(at_us)
        assert 0 <= late_us <= pace.now_us - at_us


def test_a_moment_that_has_passed_is_not_waited_for() -> None:
    pace = Pace()
    assert pace.wait_until(-1_000_000) >= 1_000_000


@pytest.mark.skipif(sys.platform != "linux", reason="a property of Linux")
def test_linux_does_not_let_it_sleep_longer() -> None:
    Pace()
    assert Path("/proc/self/timerslack_ns").read_text() == "1000\n"
