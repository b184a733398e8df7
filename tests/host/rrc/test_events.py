from __future__ import annotations

from itertools import pairwise

import pytest

from tests.host.rigs import ScriptedLink, powered_off_bench, standby_bench
from tickrig.host.links.link import LinkTimeout
from tickrig.host.rrc import Arrival, RrcClient
from tickrig.wire.rrc.replies import RrcEvent


def test_events_come_in_order_until_none_comes_in_time() -> None:
    bench = powered_off_bench()
    bench.press_power()
    kinds = [arrival.value.kind for arrival in bench.client.events(500_000)]
    assert kinds == [RrcEvent.POWER_ON, RrcEvent.POWER_ON_SUCCESS]


def test_an_event_carries_the_time_it_arrived() -> None:
    bench = powered_off_bench()
    bench.rrc.inputs.set("power_button", 1)
    power_on, success = bench.client.events(500_000)
    assert success.at_us - power_on.at_us == 300_000


@pytest.mark.parametrize("name", [b"PowerOn", b"PowerOnTrigger"])
def test_both_names_of_the_power_on_event_are_one(name: bytes) -> None:
    link = ScriptedLink()
    link.comes(5_000, b"EV:" + name + b"\n")
    arrival = RrcClient(link).wait_for(RrcEvent.POWER_ON, 10_000)
    assert arrival.value.name == name.decode()


def test_an_event_that_came_during_a_command_is_not_lost() -> None:
    bench = standby_bench()
    bench.client.poweroff()
    before_us = bench.client.now_us
    assert bench.client.wait_for(RrcEvent.BY_HOST, 1_000_000).at_us <= before_us


def test_wait_for_takes_the_events_before_it() -> None:
    bench = powered_off_bench()
    bench.press_power()
    bench.client.wait_for(RrcEvent.POWER_ON_SUCCESS, 500_000)
    assert list(bench.client.events(0)) == []


def test_an_event_that_does_not_come_is_a_timeout_that_says_which_came() -> None:
    bench = powered_off_bench()
    bench.press_power()
    with pytest.raises(LinkTimeout, match="200 ms for EV:PowerOffFinished; PowerOnTrigger came"):
        bench.client.wait_for(RrcEvent.POWER_OFF_FINISHED, 200_000)
    bench.client.wait_for(RrcEvent.POWER_ON_SUCCESS, 300_000)


def test_an_event_no_manual_lists_is_given_and_reported() -> None:
    link = ScriptedLink()
    link.comes(5_000, b"EV:DoorOpen\n")
    client = RrcClient(link)
    [arrival] = client.events(10_000)
    assert (arrival.value.name, arrival.value.kind) == ("DoorOpen", None)
    assert list(client.unknown) == [Arrival(5_000, "EV:DoorOpen")]


def test_status_comes_each_10_ms() -> None:
    bench = standby_bench()
    bench.client.status()
    stream = bench.client.statuses(50_000)
    next(stream)  # may wait behind an OK line
    times_us = [next(stream).at_us for _ in range(100)]
    assert {b - a for a, b in pairwise(times_us)} == {10_000}


def test_status_ends_with_the_success_period() -> None:
    bench = standby_bench()
    bench.client.status()
    bench.press_power()
    assert len(list(bench.client.statuses(100_000))) < 10


def test_the_latest_status_is_at_hand() -> None:
    bench = standby_bench()
    bench.client.status()
    bench.rrc.inputs.set("stick_v_pct", -40)
    bench.client.run_for(20_000)
    latest = bench.client.latest_status
    assert latest is not None
    assert latest.value.in_v_pct == -40
    assert bench.client.now_us - latest.at_us <= 10_000


def test_without_status_there_is_no_latest_status() -> None:
    assert standby_bench().client.latest_status is None


def test_commands_can_be_sent_from_within_the_status_loop() -> None:
    bench = standby_bench(stable=True)
    bench.client.status()
    for arrival in bench.client.statuses(50_000):
        bench.client.output(arrival.value.out_v_pct + 1, 0)
        if arrival.value.out_v_pct == 50:
            break
    assert bench.state() == "Output"


def test_run_for_0_takes_in_what_is_there() -> None:
    link = ScriptedLink()
    link.comes(0, b"EV:Initialized\n")
    client = RrcClient(link)
    client.run_for(0)
    assert [arrival.at_us for arrival in client.events(0)] == [0]


def test_run_for_lasts_exactly_that_long() -> None:
    bench = standby_bench()
    bench.client.status()
    before_us = bench.client.now_us
    bench.client.run_for(123_456)
    assert bench.client.now_us - before_us == 123_456
