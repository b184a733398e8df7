from __future__ import annotations

import pytest

from tests.host.rigs import ScriptedLink, powered_off_bench, standby_bench
from tickrig.host.links.link import LinkTimeout
from tickrig.host.rrc import RrcClient, RrcRefused
from tickrig.wire.rrc.commands import StableMode
from tickrig.wire.rrc.replies import RrcEvent


def spoiled(line: bytes) -> bytes:
    """Change the last character before LF, which CHECK sees."""
    return line[:-2] + b"?\n" if line.startswith(b"speedmode") else line


def test_check_is_appended_from_the_next_line_on() -> None:
    bench = standby_bench()
    bench.client.stablemode()
    bench.client.speedmode(4)
    assert bench.link.lines == [b"stablemode1", b"speedmode40A", b"device0"]


def test_a_setting_is_confirmed_by_the_device_query_behind_it() -> None:
    bench = standby_bench(stable=True)
    bench.client.speedmode(4)
    assert bench.rrc.read("speed_mode") == 4


def test_a_refused_setting_is_an_error() -> None:
    bench = standby_bench(stable=True)
    bench.link.spoil = spoiled
    with pytest.raises(RrcRefused, match=r"'speedmode40A'.*ER:CommandChecksum"):
        bench.client.speedmode(4)
    assert bench.rrc.read("speed_mode") == 1


def test_the_barrier_behind_a_refused_setting_does_not_answer_the_next_query() -> None:
    bench = standby_bench(stable=True)
    bench.link.spoil = spoiled
    with pytest.raises(RrcRefused):
        bench.client.speedmode(4)
    assert bench.client.version() == "Version 1.0"


def test_a_lost_barrier_is_a_timeout() -> None:
    bench = standby_bench(stable=True)
    bench.link.spoil = lambda line: line.replace(b"device0\n", b"")
    with pytest.raises(LinkTimeout, match="the answer of device did not come"):
        bench.client.speedmode(4)


def test_output_is_streamed() -> None:
    bench = standby_bench(stable=True)
    bench.client.output(30, 0)
    assert bench.link.lines == [b"output1e007"]


def test_output_is_confirmed_where_asked_for() -> None:
    bench = standby_bench(stable=True)
    bench.client.output(30, 0, confirm=True)
    assert bench.out_pct() == (30, 0)


def test_output_can_be_streamed_without_stablemode_too() -> None:
    bench = standby_bench()
    for v_pct in range(10):
        bench.client.output(v_pct, 0, confirm=False)
    bench.client.speedmode(2)
    assert bench.out_pct() == (9, 0)
    assert list(bench.client.unknown) == []


def test_a_stream_keeps_to_the_pace_of_the_rrc() -> None:
    bench = standby_bench(stable=True)
    bench.client.status()
    for _ in range(1_000):
        bench.client.output(10, 0)
    assert bench.link.now_us > 5_000_000
    assert bench.state() == "Output"
    assert not bench.client.unknown


def test_confirmed_settings_keep_to_the_pace_of_the_rrc() -> None:
    bench = standby_bench(stable=True)
    bench.client.status()
    for _ in range(200):
        bench.client.output(10, 0, confirm=True)
    assert bench.state() == "Output"


def test_stablemode_can_be_switched_off_again() -> None:
    bench = standby_bench(stable=True)
    bench.client.stablemode(on=False)
    bench.client.output(30, 0)
    assert bench.link.lines == [b"stablemode00", b"device", b"output1e00"]
    assert not bench.client.stable


def test_a_refused_switching_off_leaves_it_on() -> None:
    bench = standby_bench(stable=True)
    bench.link.spoil = lambda line: line.replace(b"stablemode00", b"stablemode05")
    with pytest.raises(RrcRefused, match="CommandChecksum"):
        bench.client.stablemode(on=False)
    assert bench.client.stable
    bench.link.spoil = lambda line: line
    assert bench.client.device() == "RRC"


def test_switching_it_on_twice_is_no_error() -> None:
    bench = standby_bench(stable=True)
    bench.client.stablemode()
    assert bench.client.stable


def test_a_power_cycle_of_vr2_ends_it_for_the_client_too() -> None:
    bench = standby_bench(stable=True)
    bench.press_power()
    bench.client.wait_for(RrcEvent.POWER_OFF_FINISHED, 1_000_000)
    assert not bench.client.stable
    assert bench.client.device() == "RRC"


def test_a_power_cycle_of_the_rrc_ends_it_for_the_client_too() -> None:
    bench = standby_bench(stable=True)
    bench.rrc.inputs.set("rrc_power", 0)
    bench.client.run_for(100_000)
    bench.rrc.inputs.set("rrc_power", 1)
    bench.client.wait_for(RrcEvent.INITIALIZED, 100_000)
    assert not bench.client.stable


def test_a_setting_that_is_wiped_right_after_its_ok_is_not_believed() -> None:
    link = ScriptedLink({b"stablemode1": [b"OK:stablemode\nEV:Initialized\n"]})
    client = RrcClient(link)
    client.stablemode()
    assert not client.stable


def test_stablemode_works_before_vr2_is_on() -> None:
    bench = powered_off_bench()
    bench.client.stablemode()
    bench.client.watchdog(500_000)
    assert bench.client.stable
    assert bench.client.watchdog_us == 500_000


def test_stablemode_is_confirmed_in_any_case() -> None:
    bench = standby_bench()
    bench.link.spoil = lambda line: line.replace(b"mode1", b"mode2")
    with pytest.raises(RrcRefused, match="ER:stablemode"):
        bench.client.command(StableMode(1), confirm=False)
    assert not bench.client.stable


def test_a_refused_barrier_is_a_refusal() -> None:
    bench = standby_bench(stable=True)
    bench.link.spoil = lambda line: line.replace(b"device0", b"devicex8")
    with pytest.raises(RrcRefused, match=r"'speedmode40A'.*ER:device"):
        bench.client.speedmode(4)


def test_an_ok_after_stablemode_is_not_that_of_a_renewal_with_stablemode() -> None:
    bench = standby_bench(stable=True)
    bench.client.watchdog(500_000)
    bench.client.run_for(170_000)
    assert bench.link.lines[-1] == b"watchdog326"  # a renewal, which no OK answers
    bench.client.stablemode(on=False)
    bench.client.watchdog(0)
    assert bench.client.watchdog_us == 0
