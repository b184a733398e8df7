"""A device's place in a system: who ends it, and what happens while the device is away."""

from __future__ import annotations

import pytest

from tests.device.rtc_lite.bench import Recorder
from tests.host.rtc.lite.bench import PERIOD_US, Bench
from tickrig.device.rtc_lite.component import LiteEcho
from tickrig.host.rtc import Manager, RtcRefused
from tickrig.host.rtc.lite import ProxyEvent, ProxySettings, RtcLiteProxy, attach
from tickrig.wire.instant import NEVER

AWAY_US = 3_500_000
"""Long enough for a device to be found lost and for its proxy to be removed."""


def test_the_lowest_free_number_is_taken() -> None:
    bench = Bench(LiteEcho, LiteEcho)
    assert bench.attach(0, "Echo").instance_name == "Echo0"
    assert bench.attach(1, "Echo").instance_name == "Echo1"


def test_without_a_context_it_has_its_own_at_10_hz() -> None:
    bench = Bench(LiteEcho)
    proxy = attach(bench.manager, bench.links[0], "Echo")
    assert [context.rate_hz for context in proxy.own_contexts] == [10.0]
    bench.manager.activate("Echo0")
    bench.run_to(10 * PERIOD_US + PERIOD_US // 2)
    assert bench.nodes[0].read("executed") == 10


def test_a_device_that_does_not_start_up_is_not_attached() -> None:
    bench = Bench(LiteEcho)
    bench.nodes[0].inputs.set("power_cut", 1)
    with pytest.raises(RtcRefused, match="on_initialize of Echo0 returned RTC_ERROR"):
        bench.attach(0, "Echo")
    assert bench.manager.due_us == NEVER


def test_a_proxy_that_is_deleted_finalizes_its_device_and_is_minded_no_more() -> None:
    bench = Bench(Recorder)
    bench.attach(0, "Echo", ProxySettings(rediscover=True))
    bench.context.start()
    bench.manager.activate("Echo0")
    bench.run_to(PERIOD_US)
    bench.manager.delete("Echo0")
    component = bench.nodes[0].component
    assert isinstance(component, Recorder)
    assert component.called[-2:] == ["on_deactivated", "on_finalize"]
    bench.links[0].sent.clear()
    bench.run_for(5_000_000)
    assert bench.links[0].sent == []
    assert bench.events == []


def test_the_system_may_count_time_otherwise_than_the_link() -> None:
    bench = Bench(LiteEcho)
    bench.rig.run_for(1_000_000_000)
    bench.attach(0, "Echo")
    ahead_us = bench.rig.now_us
    bench.nodes[0].inputs.set("power_cut", 1)
    cut_us = bench.rig.now_us
    while bench.rig.now_us < cut_us + 1_500_000:
        bench.rig.run_to(ahead_us + bench.manager.due_us)
        bench.manager.tick(bench.rig.now_us - ahead_us)
    assert bench.at_us("FatalError") - cut_us <= 1_402_000


def test_a_listener_that_raises_is_logged_and_the_system_lives_on(
    caplog: pytest.LogCaptureFixture,
) -> None:
    bench = Bench(LiteEcho)

    def listen(event: ProxyEvent) -> None:
        raise ZeroDivisionError

    attach(bench.manager, bench.links[0], "Echo", listener=listen)
    bench.nodes[0].inputs.set("power_cut", 1)
    bench.run_for(AWAY_US)
    assert bench.manager.components == ()
    assert "ZeroDivisionError" in caplog.text


def test_a_line_that_is_gone_is_a_lost_device() -> None:
    bench = Bench(LiteEcho)
    bench.attach(0, "Echo", ProxySettings(rediscover=True))
    bench.context.start()
    bench.manager.activate("Echo0")
    bench.run_to(PERIOD_US)
    bench.links[0].close()
    bench.run_for(AWAY_US)
    assert bench.announced() == [("FatalError", "Echo0"), ("Removed", "Echo0")]
    assert bench.manager.due_us < NEVER


def test_a_device_that_comes_back_within_the_burst_is_in_error_until_a_reset() -> None:
    bench = Bench(Recorder)
    proxy = bench.attach(0, "Echo")
    bench.context.start()
    bench.manager.activate("Echo0")
    bench.run_to(10 * PERIOD_US + PERIOD_US // 2)
    bench.nodes[0].inputs.set("power_cut", 1)
    bench.run_for(2 * PERIOD_US)
    bench.nodes[0].inputs.set("power_cut", 0)
    bench.run_for(5 * PERIOD_US)
    assert bench.announced() == [("PassiveError", "Echo0")]
    assert bench.states() == {"Echo0": "ERROR"}
    assert bench.nodes[0].read("state") == "Created"
    bench.manager.reset("Echo0")
    bench.run_for(PERIOD_US)
    assert bench.states() == {"Echo0": "INACTIVE"}
    assert bench.nodes[0].read("state") == "Inactive"
    assert proxy.fatal_us is None


def test_a_device_that_answers_but_does_not_start_up_is_looked_for_again() -> None:
    bench = Bench(Recorder)
    bench.attach(0, "Echo", ProxySettings(rediscover=True))
    bench.nodes[0].inputs.set("power_cut", 1)
    bench.run_for(AWAY_US)
    component = bench.nodes[0].component
    assert isinstance(component, Recorder)
    component.failing.add("on_initialize")
    bench.nodes[0].inputs.set("power_cut", 0)
    bench.run_for(AWAY_US)
    assert bench.manager.components == ()
    component.failing.clear()
    bench.run_for(AWAY_US)
    assert bench.announced()[-1] == ("Rediscovered", "Echo0")
    assert bench.manager.find("localhost/Echo0.rtc") is not None


def test_removal_of_a_lost_proxy_that_somebody_deletes_first_is_told_once() -> None:
    bench = Bench(LiteEcho)
    bench.attach(0, "Echo", ProxySettings(rediscover=True))
    bench.nodes[0].inputs.set("power_cut", 1)
    bench.run_to(2_000_000)
    assert bench.announced() == [("FatalError", "Echo0")]
    bench.manager.delete("Echo0")
    bench.run_for(AWAY_US)
    assert bench.announced() == [("FatalError", "Echo0")]
    assert bench.manager.due_us == NEVER


def test_a_proxy_alone_is_an_rt_component_without_pings() -> None:
    bench = Bench(LiteEcho)
    manager = Manager()
    proxy = manager.add(RtcLiteProxy("Echo0", bench.links[0]), rate_hz=10.0)
    manager.activate("Echo0")
    manager.run_for(10 * PERIOD_US)
    assert manager.state_of("Echo0").name == "ACTIVE"
    assert proxy.device_state is not None
    assert proxy.device_state.name == "ACTIVE"


def test_a_board_that_is_back_has_booted() -> None:
    bench = Bench(LiteEcho)
    bench.attach(0, "Echo", ProxySettings(boot_us=3_000_000, rediscover=True))
    bench.nodes[0].inputs.set("power_cut", 1)
    bench.run_for(AWAY_US)
    bench.nodes[0].inputs.set("power_cut", 0)
    back_us = bench.rig.now_us
    bench.run_for(AWAY_US)
    assert bench.at_us("Rediscovered") - back_us < 1_100_000


class Deleter:
    """Deletes a proxy in the tick in which it is to be removed."""

    due_us = NEVER
    proxy: RtcLiteProxy | None = None
    deleted = 0

    def __init__(self, manager: Manager) -> None:
        self._manager = manager

    def tick(self, now_us: int) -> None:
        if self.proxy and self.proxy.fatal_us and now_us >= self.proxy.fatal_us + 1_000_000:
            self._manager.delete("Echo0")
            self.proxy, self.deleted = None, self.deleted + 1


def test_a_proxy_that_is_deleted_as_it_is_to_be_removed_is_not_looked_for() -> None:
    bench = Bench(LiteEcho)
    deleter = Deleter(bench.manager)
    bench.manager.add_item(deleter)
    deleter.proxy = bench.attach(0, "Echo", ProxySettings(rediscover=True))
    bench.nodes[0].inputs.set("power_cut", 1)
    bench.run_to(AWAY_US)
    assert deleter.deleted == 1
    assert bench.announced() == [("FatalError", "Echo0")]
    assert bench.manager.due_us == NEVER
