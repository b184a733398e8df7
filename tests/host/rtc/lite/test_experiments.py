"""T1 to T7: the experiments of the paper and what belongs to them, in virtual time."""

from __future__ import annotations

from itertools import pairwise

import pytest

from tests.device.rtc_lite.bench import Recorder
from tests.host.rtc.lite.bench import PERIOD_US, TICK_US, Bench
from tests.host.rtc.lite.experiment import ALL, JOINTS, Experiment
from tests.wire.rtc_lite.vectors import raw
from tickrig.device.rtc_lite.component import LiteEcho
from tickrig.emulators.rtc_lite.line import RadioSettings, radio
from tickrig.host.rtc.commands.system_control import describe_component
from tickrig.host.rtc.commands.verbs import component_lines
from tickrig.host.rtc.lite import ProxySettings
from tickrig.host.rtc.lite.proxy import RtcLiteProxy

PHASES_US = [0, 3_000, 10_000, 11_000, 12_500, 15_000, 20_000, 50_000, 77_777, 99_999]
"""Where in a period the power is cut."""


def test_t1_numbers_pass_two_devices_in_order_in_the_period_in_which_they_were_entered() -> None:
    system = Experiment()
    system.activate()
    for number in (1, -5, 2_147_483_647):
        system.source.enter(number)
        system.run_for(PERIOD_US)
        assert system.numbers[-1] == number
    assert system.numbers == [1, -5, 2_147_483_647]
    assert set(system.states().values()) == {"ACTIVE"}


@pytest.mark.parametrize("phase_us", PHASES_US)
def test_t2_a_power_cut_while_active_is_fatal_within_10_10_and_40_ticks(phase_us: int) -> None:
    system = Experiment()
    system.activate()
    system.run_to(1_000_000 + phase_us)
    cut_us = system.rig.now_us
    system.nodes[0].inputs.set("power_cut", 1)
    system.run_for(2_000_000)
    fatal_us = system.at_us("FatalError")
    assert 40 * TICK_US <= fatal_us - cut_us <= 60 * TICK_US
    assert 100 * TICK_US <= system.at_us("Removed") - fatal_us < 101 * TICK_US
    assert system.announced() == [("FatalError", "LiteA0"), ("Removed", "LiteA0")]


def test_t2_step_by_step() -> None:
    system = Experiment()
    system.activate()
    system.run_to(1_050_000)
    system.nodes[0].inputs.set("power_cut", 1)
    system.run_to(1_199_999)  # the request at 1.1 s waits for its reply
    assert system.states()["LiteA0"] == "ACTIVE"
    system.run_to(1_300_000)
    assert system.states() == dict.fromkeys(ALL, "ACTIVE") | {"LiteA0": "ERROR"}
    system.run_to(1_700_000)
    assert system.at_us("FatalError") == 1_600_000
    assert len(system.manager.connectors) == len(JOINTS)
    system.run_to(2_590_000)
    assert "LiteA0.rtc" in system.manager.names.names("localhost")
    system.run_to(2_650_000)
    assert system.manager.names.names("localhost") == (
        "ConsoleIn0.rtc",
        "LiteB0.rtc",
        "ConsoleOut0.rtc",
    )
    assert [profile.ports for profile in system.manager.connectors] == [JOINTS[2]]
    assert set(system.states().values()) == {"ACTIVE"}


def test_t2_after_the_cut_nothing_is_sent_but_one_request_and_four_pings() -> None:
    system = Experiment()
    system.activate()
    system.run_to(1_050_000)
    system.nodes[0].inputs.set("power_cut", 1)
    system.links[0].sent.clear()
    system.run_to(4_000_000)
    assert [(at_us, data[1:3]) for at_us, data in system.links[0].sent] == [
        (1_100_000, b"AE"),
        (1_200_000, b"CY"),
        (1_300_000, b"CY"),
        (1_400_000, b"CY"),
        (1_500_000, b"CY"),
    ]


def test_t2_the_others_run_on_while_a_device_is_in_doubt() -> None:
    system = Experiment()
    system.activate()
    system.run_to(1_050_000)
    system.nodes[0].inputs.set("power_cut", 1)
    before = system.nodes[1].read("executed")
    system.run_to(2_050_000)
    assert isinstance(before, int)
    assert system.nodes[1].read("executed") == before + 10


@pytest.mark.parametrize("phase_us", [*PHASES_US, 500_000, 950_000])
def test_t3_a_power_cut_while_inactive_is_fatal_within_140_ticks(phase_us: int) -> None:
    system = Experiment()
    system.run_to(3_000_000 + phase_us)
    cut_us = system.rig.now_us
    system.nodes[0].inputs.set("power_cut", 1)
    system.run_for(2_500_000)
    assert 39 * TICK_US <= system.at_us("FatalError") - cut_us <= 140 * TICK_US
    assert "LiteA0" not in system.states()


def test_t3_a_frame_that_was_on_the_line_at_the_cut_still_counts() -> None:
    system = Experiment()
    system.run_to(3_000_000)
    ping_us = next(at_us for at_us, data in system.links[0].sent if data[1:3] == b"CY")
    for cut_us in range(ping_us, ping_us + 5_000, 250):
        system = Experiment()
        system.run_to(cut_us)
        system.nodes[0].inputs.set("power_cut", 1)
        system.run_for(2_000_000)
        assert system.at_us("FatalError") - cut_us <= 140 * TICK_US + 2_000


def test_devices_that_fail_together_are_found_together() -> None:
    system = Experiment()
    system.run_to(2_500_000)
    for node in system.nodes:
        node.inputs.set("power_cut", 1)
    system.run_for(2_000_000)
    first_us, second_us = (event.at_us for event in system.events if event.kind == "FatalError")
    assert second_us - first_us < 50_000


def test_t4_every_second_lost_ping_is_not_fatal() -> None:
    system = Experiment()
    system.lines[0].arm("ping", "0.5")
    system.run_to(30_000_000)
    pings = [data for _, data in system.links[0].sent if data[1:3] == b"CY"]
    assert len(pings) > 30
    assert system.events == []
    assert system.states() == dict.fromkeys(ALL, "INACTIVE")


def test_t4_four_lost_pings_are_fatal_40_ticks_after_the_first() -> None:
    system = Experiment()
    system.run_to(3_000_000)
    system.lines[0].arm("ping", "1.0")
    system.links[0].sent.clear()
    system.run_for(1_500_000)
    sent_us = [at_us for at_us, data in system.links[0].sent if data[1:3] == b"CY"]
    assert [at_us - sent_us[0] for at_us in sent_us] == [0, 100_000, 200_000, 300_000]
    assert system.at_us("FatalError") - sent_us[0] == 40 * TICK_US


def pinged_us(system: Bench) -> list[int]:
    """Return when PINGs were sent to the first device."""
    return [at_us for at_us, data in system.links[0].sent if data[1:3] == b"CY"]


def test_pings_leave_at_a_fixed_period_whatever_else_is_on_the_line() -> None:
    system = Experiment()
    system.run_to(2_500_000)
    system.activate()
    for number in range(150):
        system.source.enter(number)
        system.run_for(PERIOD_US)
    assert len(system.numbers) == 150
    sent_us = pinged_us(system)
    late_us = [at_us - sent_us[0] - n * 100 * TICK_US for n, at_us in enumerate(sent_us)]
    assert all(0 <= each <= TICK_US for each in late_us)  # the line was not free, and no more
    assert len(sent_us) == system.rig.now_us // (100 * TICK_US)


@pytest.mark.parametrize("state", ["inactive", "active", "error"])
def test_pings_leave_in_every_state(state: str) -> None:
    bench, _ = recorder_bench()
    recorder = bench.nodes[0].component
    assert isinstance(recorder, Recorder)
    if state == "inactive":
        bench.manager.deactivate("Echo0")
    if state == "error":
        recorder.failing.add("on_execute")
    bench.run_for(2 * PERIOD_US)
    assert bench.states() == {"Echo0": state.upper()}
    bench.links[0].sent.clear()
    bench.run_for(5_000_000)
    assert len(pinged_us(bench)) == 5


def test_a_burst_does_not_shift_the_next_ping() -> None:
    system = Experiment()
    system.run_to(3_500_000)
    before_us = pinged_us(system)[-1]
    system.lines[0].arm("ping", "1.0")
    system.run_to(before_us + 1_250_000)  # the third of the burst is answered
    system.lines[0].clear("ping")
    system.run_to(before_us + 3_050_000)
    assert [at_us - before_us for at_us in pinged_us(system) if at_us > before_us] == [
        *(1_000_000, 1_100_000, 1_200_000, 1_300_000),
        *(2_000_000, 3_000_000),
    ]
    assert system.events == []


def test_the_statistics_of_pings_are_in_the_profile_and_in_the_event_of_a_removal() -> None:
    system = Experiment()
    system.run_to(10_500_000)
    pings = system.lite_a.pings
    assert (pings.sent, pings.answered, pings.lost) == (10, 10, 0)
    assert 1_000 < pings.shortest_us <= pings.mean_us <= pings.longest_us < 10_000
    shown = "\n".join(
        component_lines(describe_component(system.manager, system.lite_a), long=False)
    )
    assert "  Property      rtc_lite.pings = 10 sent, 10 answered, 0 lost; round trip" in shown
    system.nodes[0].inputs.set("power_cut", 1)
    system.run_for(3_000_000)
    removed = system.events[-1]
    assert removed.kind == "Removed"
    assert removed.pings is not None
    assert (removed.pings.sent, removed.pings.answered, removed.pings.lost) == (14, 10, 4)
    assert "; PINGs: 14 sent, 10 answered, 4 lost; round trip " in str(removed)


def test_over_a_lossy_radio_an_inactive_device_is_kept() -> None:
    bench = Bench(LiteEcho)
    bench.lines[0].fault_types = {"radio": radio(RadioSettings(up_us=0))}
    proxy = bench.attach(0, "Echo")
    bench.lines[0].arm("radio", "0.1")
    bench.run_to(60_000_000)
    assert bench.events == []
    assert 0 < proxy.pings.lost < 20
    assert (
        36_000 <= proxy.pings.shortest_us < proxy.pings.mean_us < proxy.pings.longest_us <= 65_000
    )


def test_a_dropout_of_seconds_removes_the_device_and_it_is_found_again() -> None:
    bench = Bench(LiteEcho)
    settings = RadioSettings(up_us=10_000_000, dropout_us=3_000_000)
    bench.lines[0].fault_types = {"radio": radio(settings)}
    bench.attach(0, "Echo", ProxySettings(rediscover=True))
    bench.lines[0].arm("radio", "0.001")
    bench.run_to(60_000_000)
    kinds = [event.kind.value for event in bench.events]
    assert kinds[:3] == ["FatalError", "Removed", "Rediscovered"]
    assert len(kinds) >= 6


def test_answers_to_older_pings_are_ignored() -> None:
    system = Experiment()
    system.run_to(3_000_000)
    system.nodes[0].inputs.set("slow_answer", 1)  # each 200 ms late, two PINGs behind
    system.links[0].heard = b""
    system.run_for(1_500_000)
    assert b"CY@" in system.links[0].heard
    pings_us = [at_us for at_us, data in system.links[0].sent if data[1:3] == b"CY"]
    assert system.at_us("FatalError") - pings_us[-4] == 40 * TICK_US


def test_t5_an_error_of_the_device_is_mirrored_and_a_reset_leads_back() -> None:
    bench, proxy = recorder_bench()
    recorder = bench.nodes[0].component
    assert isinstance(recorder, Recorder)
    recorder.failing.add("on_execute")
    bench.run_for(3 * PERIOD_US)
    assert bench.states() == {"Echo0": "ERROR"}
    assert recorder.called == [
        *("on_execute", "on_deactivated", "on_aborting"),
        *("on_error", "on_error"),
    ]
    assert bench.announced() == [("PassiveError", "Echo0")]
    recorder.failing.clear()
    bench.manager.reset("Echo0")
    bench.run_for(PERIOD_US)
    assert bench.states() == {"Echo0": "INACTIVE"}
    bench.manager.activate("Echo0")
    bench.run_for(PERIOD_US)
    assert bench.states() == {"Echo0": "ACTIVE"}
    assert recorder.called[5:] == ["on_reset", "on_activated", "on_execute"]
    assert proxy.fatal_us is None


def recorder_bench() -> tuple[Bench, RtcLiteProxy]:
    """An active recorder, in the middle of a period."""
    bench = Bench(Recorder)
    proxy = bench.attach(0, "Echo")
    bench.context.start()
    bench.manager.activate("Echo0")
    bench.run_to(2 * PERIOD_US + PERIOD_US // 2)
    component = bench.nodes[0].component
    assert isinstance(component, Recorder)
    component.called.clear()
    return bench, proxy


def test_t6_noise_between_frames_does_no_harm() -> None:
    bench = Bench(LiteEcho)
    bench.links[0].spoil = lambda frame: b"\xff\x00\x55" + frame
    bench.attach(0, "Echo")
    bench.context.start()
    bench.manager.activate("Echo0")
    bench.run_to(10 * PERIOD_US)
    assert bench.states() == {"Echo0": "ACTIVE"}
    assert bench.events == []


def test_t6_a_wrong_checksum_is_a_passive_error_and_the_next_frame_is_right() -> None:
    bench, _ = recorder_bench()
    bench.links[0].spoil = lambda frame: frame[:-1] + bytes([frame[-1] ^ 1])
    bench.links[0].heard = b""
    bench.run_for(PERIOD_US)
    assert bench.links[0].heard == raw("0A 46 48 03 91")
    bench.links[0].spoil = lambda frame: frame
    bench.run_for(PERIOD_US)
    assert bench.states() == {"Echo0": "ERROR"}
    assert bench.nodes[0].read("state") == "Error"
    assert bench.announced() == [("PassiveError", "Echo0")]


def test_t7_a_device_that_is_back_gets_a_new_proxy_without_connectors() -> None:
    system = Experiment(rediscover=True)
    system.activate()
    system.run_to(1_050_000)
    system.nodes[0].inputs.set("power_cut", 1)
    system.run_to(5_000_000)
    system.nodes[0].inputs.set("power_cut", 0)
    system.run_for(100 * TICK_US + PERIOD_US)
    proxy = system.manager.find("LiteA0")
    assert proxy is not system.lite_a
    assert list(proxy.ports) == ["in", "out"]
    assert system.states() == dict.fromkeys(ALL, "ACTIVE") | {"LiteA0": "INACTIVE"}
    assert [profile.ports for profile in system.manager.connectors] == [JOINTS[2]]
    assert system.announced()[-1] == ("Rediscovered", "LiteA0")
    for first, second in JOINTS[:2]:
        system.manager.connect(first, second)
    system.manager.activate("LiteA0")
    system.source.enter(7)
    system.run_for(2 * PERIOD_US)
    assert system.numbers == [7]


def test_t7_the_device_is_asked_each_100_ticks() -> None:
    system = Experiment(rediscover=True)
    system.nodes[0].inputs.set("power_cut", 1)
    system.run_to(3_000_000)
    assert system.announced()[-1] == ("Removed", "LiteA0")
    system.links[0].sent.clear()
    system.run_for(5_000_000)
    sent_us = [at_us for at_us, _ in system.links[0].sent]
    assert {after - before for before, after in pairwise(sent_us)} == {100 * TICK_US}
    assert {data for _, data in system.links[0].sent} == {raw("0A 43 58 9B")}


def test_removal_may_follow_at_once() -> None:
    bench = Bench(LiteEcho)
    bench.attach(0, "Echo", ProxySettings(linger_us=0))
    bench.nodes[0].inputs.set("power_cut", 1)
    bench.run_to(2_000_000)
    assert bench.at_us("Removed") == bench.at_us("FatalError")
    assert bench.manager.components == ()
