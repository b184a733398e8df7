from __future__ import annotations

import pytest

from tests.host.rigs import powered_off_bench, standby_bench
from tickrig.host.rrc import RrcRefused
from tickrig.wire.rrc.replies import RrcEvent


def test_the_slowest_speed_mode_comes_before_a_change_of_the_driver() -> None:
    bench = standby_bench()
    bench.client.drive_by_stick(100, 100)
    bench.client.speedmode(4)
    bench.client.drive_by_host(30, 0)
    bench.client.speedmode(4)
    bench.client.drive_by_stick(50, 50)
    assert bench.link.lines == [
        *(b"speedmode10", b"limit6464ffffff", b"speedmode40"),
        *(b"speedmode10", b"output1e00", b"speedmode40"),
        *(b"speedmode10", b"limit3232ffffff"),
    ]


def test_it_does_not_come_again_while_the_driver_stays() -> None:
    bench = standby_bench(stable=True)
    for v_pct in (10, 20, 30):
        bench.client.drive_by_host(v_pct, 0)
    assert bench.link.lines == [
        *(b"speedmode107", b"device0"),
        *(b"output0a002", b"device0", b"output14006", b"output1e007"),
    ]


def test_the_lock_of_the_speed_buttons_is_kept() -> None:
    bench = standby_bench()
    bench.client.speedmode(4, locked=True)
    bench.client.drive_by_host(30, 0)
    assert b"speedmode11" in bench.link.lines


def test_after_a_power_cycle_the_driver_is_unknown() -> None:
    bench = standby_bench()
    bench.client.drive_by_host(30, 0)
    bench.press_power()
    bench.client.wait_for(RrcEvent.INITIALIZED, 1_000_000)
    bench.press_power()
    bench.client.wait_for(RrcEvent.POWER_ON_SUCCESS, 1_000_000)
    bench.link.sent.clear()
    bench.client.drive_by_host(30, 0)
    assert bench.link.lines == [b"speedmode10", b"output1e00"]


def test_a_refused_output_does_not_count_as_driving() -> None:
    bench = powered_off_bench(max_refusals=10)
    for _ in range(2):
        with pytest.raises(RrcRefused):
            bench.client.drive_by_host(30, 0)
    assert bench.link.lines == [b"speedmode10", b"output1e00"] * 2


def test_a_stream_of_output_leaves_it_uncertain_who_drives() -> None:
    bench = standby_bench(stable=True)
    bench.client.drive_by_stick(100, 100)
    bench.client.output(30, 0)
    bench.link.sent.clear()
    bench.client.drive_by_stick(100, 100)
    assert bench.link.lines[0] == b"speedmode107"
