"""A device that executes by its own timer (type 22h)."""

from __future__ import annotations

from tests.device.rtc_lite.bench import Recorder
from tests.host.rtc.lite.bench import PERIOD_US, Bench
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.host.rtc import InPort, OutPort, ReturnCode, connect
from tickrig.host.rtc.lite.proxy import RtcLiteProxy
from tickrig.wire.rtc_lite.codes import LiteContextType
from tickrig.wire.rtc_types.rtc import Time, TimedLong

CONFIG = LiteConfig(context=LiteContextType.TIMER, rate_hz=100)


def active() -> tuple[Bench, RtcLiteProxy, Recorder]:
    bench = Bench(Recorder, config=CONFIG)
    proxy = bench.attach(0, "Echo")
    bench.context.start()
    bench.manager.activate("Echo0")
    bench.run_to(PERIOD_US + PERIOD_US // 2)
    component = bench.nodes[0].component
    assert isinstance(component, Recorder)
    bench.links[0].sent.clear()
    return bench, proxy, component


def test_data_pass_both_ways_and_are_stamped_when_they_arrive() -> None:
    bench, proxy, _ = active()
    out, in_ = OutPort("out", TimedLong), InPort("in", TimedLong)
    connect(out, proxy.ports["in"])
    connect(proxy.ports["out"], in_)
    for number in (1, 2, 3):
        out.write(TimedLong(Time(), number))
    bench.run_for(4 * PERIOD_US)
    values = []
    while in_.is_new and (value := in_.read()) is not None:
        values.append(value)
    assert [value.data for value in values] == [1, 2, 3]
    assert all(0 < value.tm.us <= bench.rig.now_us for value in values)


def test_a_period_asks_for_the_state_and_not_to_execute() -> None:
    bench, _, _ = active()
    bench.run_for(3 * PERIOD_US)
    assert [data[1:3] for _, data in bench.links[0].sent] == [b"CX", b"CX", b"CX"]


def test_the_state_is_asked_each_10th_tick_however_short_the_period_is() -> None:
    bench, _, _ = active()
    bench.context.set_rate(100.0)
    bench.run_for(PERIOD_US)
    bench.links[0].sent.clear()
    bench.run_for(10 * PERIOD_US)
    requested_us = [at_us for at_us, data in bench.links[0].sent if data[1:3] == b"CX"]
    assert 9 <= len(requested_us) <= 10
    assert bench.events == []


def test_an_error_of_the_device_is_seen_within_a_period_of_10_ticks() -> None:
    bench, _, recorder = active()
    recorder.failing.add("on_execute")
    bench.run_for(2 * PERIOD_US)
    assert bench.states() == {"Echo0": "ERROR"}
    assert bench.announced() == [("PassiveError", "Echo0")]
    requests = {data[1:3] for _, data in bench.links[0].sent}
    assert requests == {b"CX"}
    recorder.failing.clear()
    bench.manager.reset("Echo0")
    bench.run_for(PERIOD_US)
    assert bench.states() == {"Echo0": "INACTIVE"}
    assert bench.nodes[0].read("state") == "Inactive"


def test_a_new_rate_is_given_to_the_device_as_a_whole_number() -> None:
    bench, proxy, recorder = active()
    assert bench.context.set_rate(2.6) is ReturnCode.RTC_OK
    assert bench.links[0].sent[-1][1][1:5] == b"BW\x03\x00"
    recorder.called.clear()
    bench.run_for(1_100_000)
    assert recorder.called.count("on_execute") == 3
    assert proxy.fatal_us is None


def test_a_rate_that_the_device_does_not_have_leads_to_error() -> None:
    bench, _, _ = active()
    bench.context.set_rate(2_000.0)
    bench.run_for(PERIOD_US)
    assert bench.states() == {"Echo0": "ERROR"}


def test_a_power_cut_is_fatal() -> None:
    bench, _, _ = active()
    cut_us = bench.rig.now_us
    bench.nodes[0].inputs.set("power_cut", 1)
    bench.run_for(2_000_000)
    assert bench.at_us("FatalError") - cut_us <= 600_000
    assert bench.states() == {}


def test_up_to_three_lost_questions_for_the_state_are_no_error() -> None:
    bench, proxy, recorder = active()
    for lost in (1, 2, 3):
        bench.links[0].spoil = Losing(b"CX", lost)
        bench.run_for(10 * PERIOD_US)
        assert bench.states() == {"Echo0": "ACTIVE"}
    bench.links[0].spoil = Losing(b"CX", 4)
    bench.run_for(10 * PERIOD_US)
    assert bench.states() == {"Echo0": "ERROR"}
    assert bench.announced() == [("PassiveError", "Echo0")]
    assert "on_aborting" in recorder.called
    assert proxy.fatal_us is None


class Losing:
    """Loses so many requests of one kind."""

    def __init__(self, command: bytes, count: int) -> None:
        self._command, self._count = command, count

    def __call__(self, frame: bytes) -> bytes:
        if frame[1:3] != self._command or not self._count:
            return frame
        self._count -= 1
        return b""


def test_what_is_pushed_until_the_device_is_inactive_arrives_before_the_next_activation() -> None:
    bench, proxy, _ = active()
    out, in_ = OutPort("out", TimedLong), InPort("in", TimedLong)
    connect(out, proxy.ports["in"])
    connect(proxy.ports["out"], in_)
    out.write(TimedLong(Time(), 7))
    bench.run_to(bench.context.due_us + 6_000)  # the value is in, and no period has ended
    bench.manager.deactivate("Echo0")
    bench.run_for(PERIOD_US)
    assert bench.states() == {"Echo0": "INACTIVE"}
    value = in_.read() if in_.is_new else None
    assert value is not None
    assert value.data == 7
