"""Why a component went to Error: in the event that tells of it."""

from __future__ import annotations

from tests.host.rtc.lite.bench import PERIOD_US, Bench
from tests.host.rtc.lite.test_experiments import recorder_bench
from tests.host.rtc.lite.test_timer import active
from tests.host.spy_link import SpyLink
from tickrig.device.rtc_lite.component import LiteEcho
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.emulators.rig.rig import Rig
from tickrig.host.links.link import Link
from tickrig.host.rtc.lite import ProxySettings
from tickrig.host.rtc.lite.events import ProxyEvent, ProxyEventType
from tickrig.wire.rtc_lite.frame import Framing


def only_event(bench: Bench) -> ProxyEvent:
    (event,) = bench.events
    return event


def test_an_error_of_a_callback_is_told_with_the_last_frames() -> None:
    bench, _ = recorder_bench()
    recorder = bench.nodes[0].component
    recorder.failing.add("on_execute")  # type: ignore[attr-defined]  # a Recorder
    bench.run_for(2 * PERIOD_US)
    event = only_event(bench)
    assert event.reason == "AE was answered x: a callback failed"
    assert event.frames[-2:] == ("0.300 > AE", "0.302 < AExE")
    assert str(event).startswith(
        "0.400 s: Echo0: PassiveError: AE was answered x: a callback failed; last frames: 0."
    )
    assert str(event).endswith(", 0.300 > AE, 0.302 < AExE")


def test_a_lost_device_is_told_with_the_request_that_it_left_out() -> None:
    bench, _ = recorder_bench()
    bench.nodes[0].inputs.set("power_cut", 1)
    bench.run_for(10 * PERIOD_US)
    event = bench.events[0]
    assert event.kind is ProxyEventType.FATAL_ERROR
    assert event.reason == "no reply to AE within 100 ms, and none of 4 PINGs was answered"
    assert [frame.split()[1:] for frame in event.frames[-5:]] == [
        [">", "AE"],
        *([">", f"CY\\x0{n}"] for n in range(1, 5)),
    ]


def test_a_device_that_is_lost_while_it_is_inactive_is_told_with_its_pings() -> None:
    bench = Bench(LiteEcho)
    bench.attach(0, "Echo")
    bench.nodes[0].inputs.set("power_cut", 1)
    bench.run_for(15 * PERIOD_US)
    assert bench.events[0].reason == "none of 4 PINGs was answered"


def test_a_callback_that_a_board_leaves_out_is_no_reason() -> None:
    bench = Bench(LiteEcho, config=LiteConfig(Framing.RTNO))
    bench.attach(0, "Board", ProxySettings(framing=Framing.RTNO))
    bench.context.start()
    bench.run_for(PERIOD_US)
    bench.nodes[0].inputs.set("power_cut", 1)
    bench.run_for(15 * PERIOD_US)
    assert bench.events[0].reason == "none of 4 PINGs was answered"


def test_a_single_lost_reply_is_told() -> None:
    bench, _ = recorder_bench()
    bench.lines[0].arm("cut")
    bench.run_for(PERIOD_US)
    bench.lines[0].clear("cut")
    bench.run_for(3 * PERIOD_US)
    event = only_event(bench)
    assert (event.kind, event.reason) == (
        ProxyEventType.PASSIVE_ERROR,
        "no reply to AE within 100 ms",
    )


def test_a_wrong_checksum_is_told() -> None:
    bench, _ = recorder_bench()
    bench.links[0].spoil = lambda frame: frame[:-1] + bytes([frame[-1] ^ 1])
    bench.run_for(PERIOD_US)
    bench.links[0].spoil = lambda frame: frame
    bench.run_for(PERIOD_US)
    assert only_event(bench).reason == "AE was answered FH: wrong checksum"


def test_a_device_that_went_to_error_by_itself_is_told() -> None:
    bench, _, recorder = active()
    recorder.failing.add("on_execute")
    bench.run_for(2 * PERIOD_US)
    assert only_event(bench).reason == "the device is no longer Active"


def test_an_abort_that_somebody_asked_for_is_told_as_such() -> None:
    bench, proxy = recorder_bench()
    bench.context.abort_component(proxy)
    bench.run_for(PERIOD_US)
    assert only_event(bench).reason == "it was commanded to abort"


class StoppedLink(SpyLink):
    """The process is stopped behind each look in vain, for longer than a reply may take."""

    rig: Rig

    def receive(self, timeout_us: int, /) -> bytes:
        data = super().receive(0)
        if not data and timeout_us:
            self.rig.run_for(300_000)
        return data


def test_a_reply_that_came_while_this_process_was_stopped_is_one() -> None:
    bench = Bench(LiteEcho)
    line: Link[bytes] = bench.links[0]
    bench.links[0] = stopped = StoppedLink(line)
    stopped.rig = bench.rig
    bench.attach(0, "Echo", ProxySettings(ping_period_us=200_000))
    bench.context.start()
    bench.manager.activate("Echo0")
    bench.run_for(50 * PERIOD_US)
    assert bench.events == []
    assert bench.states() == {"Echo0": "ACTIVE"}
