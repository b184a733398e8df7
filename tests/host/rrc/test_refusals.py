from __future__ import annotations

import pytest

from tests.host.rigs import Bench, powered_off_bench, standby_bench
from tickrig.host.rrc import OnRefusals, RrcRefused, RrcStopped
from tickrig.wire.rrc.replies import RrcEvent


def spoil_output(line: bytes) -> bytes:
    return line.replace(b"output", b"outp!t")


def stream(bench: Bench, commands: int, period_us: int = 10_000) -> None:
    for _ in range(commands):
        bench.client.output(30, 0)
        bench.client.run_for(period_us)


def test_the_third_refusal_in_a_row_stops_the_client() -> None:
    bench = powered_off_bench()
    for _ in range(2):
        with pytest.raises(RrcRefused):
            bench.client.output(30, 0)
    with pytest.raises(
        RrcStopped, match=r"3 refusals in a row \(last answer ER:output\)"
    ) as caught:
        bench.client.output(30, 0)
    assert caught.value.code == "output"
    assert isinstance(caught.value.__cause__, RrcRefused)


def test_a_command_that_works_begins_a_new_row() -> None:
    bench = standby_bench()
    for _ in range(3):
        bench.link.spoil = spoil_output
        for _ in range(2):
            with pytest.raises(RrcRefused):
                bench.client.output(30, 0)
        bench.link.spoil = lambda line: line
        bench.client.output(30, 0)
    assert not bench.client.stopped


def test_another_command_that_works_does_not() -> None:
    bench = standby_bench()
    bench.link.spoil = spoil_output
    for _ in range(2):
        with pytest.raises(RrcRefused):
            bench.client.output(30, 0)
        bench.client.beep()
    with pytest.raises(RrcStopped):
        bench.client.output(30, 0)


def test_refusals_in_a_stream_stop_it() -> None:
    bench = standby_bench(stable=True)
    bench.link.spoil = spoil_output
    with pytest.raises(RrcStopped):
        stream(bench, 10)


def test_a_line_that_is_noisy_now_and_then_does_not_stop_a_stream() -> None:
    bench = standby_bench(stable=True)
    numbers = iter(range(1_000_000))
    bench.link.spoil = lambda line: line if next(numbers) % 10 else spoil_output(line)
    stream(bench, 1_000)
    assert bench.out_pct() == (30, 0)


def test_a_stopped_client_sends_no_command() -> None:
    bench = powered_off_bench(max_refusals=1)
    with pytest.raises(RrcStopped):
        bench.client.limit(100, 100)
    bench.link.sent.clear()
    with pytest.raises(RrcStopped, match="output not sent after 1 refusals in a row"):
        bench.client.output(30, 0)
    with pytest.raises(RrcStopped, match="beep not sent"):
        bench.client.beep()
    assert bench.link.sent == []


def test_a_stopped_client_still_hears() -> None:
    bench = powered_off_bench(max_refusals=1)
    with pytest.raises(RrcStopped):
        bench.client.limit(100, 100)
    bench.press_power()
    bench.client.wait_for(RrcEvent.POWER_ON_SUCCESS, 1_000_000)


def test_the_stop_sends_poweroff() -> None:
    bench = standby_bench(stable=True)
    bench.client.watchdog(2_550_000)
    bench.link.spoil = spoil_output
    with pytest.raises(RrcStopped):
        stream(bench, 10)
    bench.client.wait_for(RrcEvent.BY_HOST, 100_000)


def test_the_stop_can_be_left_to_the_watchdog() -> None:
    bench = standby_bench(stable=True, on_refusals=OnRefusals.WATCHDOG)
    bench.client.watchdog(200_000)
    bench.link.spoil = spoil_output
    with pytest.raises(RrcStopped):
        stream(bench, 10)
    assert b"poweroff8" not in bench.link.lines
    bench.client.wait_for(RrcEvent.BY_WATCHDOG, 300_000)


def test_without_a_watchdog_there_is_nothing_to_leave_it_to() -> None:
    bench = standby_bench(stable=True, on_refusals=OnRefusals.WATCHDOG)
    bench.link.spoil = spoil_output
    with pytest.raises(RrcStopped):
        stream(bench, 10)
    bench.client.wait_for(RrcEvent.BY_HOST, 100_000)


def test_a_stopped_client_may_send_poweroff() -> None:
    bench = standby_bench(stable=True, on_refusals=OnRefusals.WATCHDOG)
    bench.client.watchdog(2_550_000)
    bench.link.spoil = spoil_output
    with pytest.raises(RrcStopped):
        stream(bench, 10)
    bench.client.poweroff()
    assert bench.state() == "PowerOffByOthers"


def test_resume_lifts_the_stop() -> None:
    bench = standby_bench(on_refusals=OnRefusals.WATCHDOG, max_refusals=1)
    bench.client.watchdog(2_550_000)
    bench.link.spoil = spoil_output
    with pytest.raises(RrcStopped):
        bench.client.output(30, 0)
    bench.link.spoil = lambda line: line
    bench.client.resume()
    bench.client.output(30, 0)
    assert bench.state() == "Output"


def test_a_power_cycle_lifts_the_stop() -> None:
    bench = standby_bench(max_refusals=1)
    bench.link.spoil = spoil_output
    with pytest.raises(RrcStopped):
        bench.client.output(30, 0)
    bench.link.spoil = lambda line: line
    bench.press_power()
    bench.client.wait_for(RrcEvent.INITIALIZED, 1_000_000)
    bench.press_power()
    bench.client.wait_for(RrcEvent.POWER_ON_SUCCESS, 1_000_000)
    bench.client.output(30, 0)
    assert bench.state() == "Output"


def test_three_refused_renewals_stop_the_client_too() -> None:
    bench = standby_bench(stable=True)
    bench.client.watchdog(100_000)
    bench.link.spoil = lambda line: line.replace(b"watchdog", b"watchd0g")
    with pytest.raises(RrcStopped, match="CommandChecksum"):
        bench.client.run_for(1_000_000)


def test_at_least_one_refusal_must_be_allowed() -> None:
    with pytest.raises(ValueError, match="0 refusals"):
        standby_bench(max_refusals=0)


def test_a_stop_that_comes_during_another_command_is_raised_by_it() -> None:
    bench = standby_bench(stable=True, on_refusals=OnRefusals.WATCHDOG)
    bench.client.watchdog(2_550_000)
    bench.link.spoil = spoil_output
    for _ in range(3):
        bench.client.output(30, 0)
    with pytest.raises(RrcStopped):
        bench.client.device()


def test_resume_forgets_a_stop_that_was_not_raised_yet() -> None:
    bench = standby_bench(on_refusals=OnRefusals.WATCHDOG, max_refusals=1)
    bench.client.watchdog(2_550_000)
    bench.link.spoil = spoil_output
    with pytest.raises(RrcStopped):
        bench.client.output(30, 0)
    bench.client.resume()
    bench.client.run_for(1_000_000)
    assert not bench.client.stopped


@pytest.mark.parametrize("period_us", [10_000, 30_000, 60_000, 100_000, 130_000, 500_000])
def test_renewals_in_between_do_not_hide_that_every_output_is_refused(period_us: int) -> None:
    bench = standby_bench(stable=True)
    bench.client.watchdog(2_550_000)
    bench.client.status()
    bench.link.spoil = spoil_output
    refused_before = bench.link.heard.count(b"ER:")
    with pytest.raises(RrcStopped):
        stream(bench, 10, period_us)
    assert bench.link.heard.count(b"ER:") - refused_before == 3


def test_a_refused_command_and_the_query_behind_it_are_one_refusal() -> None:
    bench = standby_bench(stable=True, max_refusals=2)
    bench.link.spoil = lambda line: {
        b"speedmode40A\n": b"speedmode60C\n",
        b"device0\n": b"devicex8\n",
    }.get(line, line)
    with pytest.raises(RrcRefused):
        bench.client.speedmode(4)
    assert not bench.client.stopped
