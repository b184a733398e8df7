"""A proxy of a node in bridge mode, which speaks packets of RTno."""

from __future__ import annotations

import pytest

from tests.device.rtc_lite.bench import Recorder
from tests.host.rtc.lite.bench import PERIOD_US, Bench
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.host.rtc import InPort, OutPort, connect
from tickrig.host.rtc.lite import ProxySettings
from tickrig.host.rtc.lite.proxy import RtcLiteProxy
from tickrig.wire.rtc_lite.frame import Checksum, Framing
from tickrig.wire.rtc_types.rtc import Time, TimedLong

RTNO = ProxySettings(framing=Framing.RTNO, rediscover=True)


def active() -> tuple[Bench, RtcLiteProxy, Recorder]:
    bench = Bench(Recorder, config=LiteConfig(Framing.RTNO))
    proxy = bench.attach(0, "RTno", RTNO)
    bench.context.start()
    bench.manager.activate("RTno0")
    bench.run_to(PERIOD_US + PERIOD_US // 2)
    component = bench.nodes[0].component
    assert isinstance(component, Recorder)
    component.called.clear()
    bench.links[0].sent.clear()
    return bench, proxy, component


def test_ports_are_made_and_a_value_passes() -> None:
    bench, proxy, _ = active()
    assert list(proxy.ports) == ["in", "out"]
    assert proxy.profile.properties["rtc_lite.type_name"] == "RTno"
    out, in_ = OutPort("out", TimedLong), InPort("in", TimedLong)
    connect(out, proxy.ports["in"])
    connect(proxy.ports["out"], in_)
    out.write(TimedLong(Time(), -5))
    bench.run_for(PERIOD_US)
    value = in_.read()
    assert value is not None
    assert value.data == -5
    assert [data[2:3] for _, data in bench.links[0].sent] == [b"S", b"E"]


def test_an_error_is_mirrored_and_a_reset_leads_back() -> None:
    bench, _, recorder = active()
    recorder.failing.add("on_execute")
    bench.run_for(2 * PERIOD_US)
    assert bench.states() == {"RTno0": "ERROR"}
    assert recorder.called == ["on_execute", "on_deactivated", "on_aborting", "on_error"]
    recorder.failing.clear()
    bench.manager.reset("RTno0")
    bench.run_for(PERIOD_US)
    assert bench.states() == {"RTno0": "INACTIVE"}
    assert bench.nodes[0].read("state") == "Inactive"


def test_a_lost_reply_deactivates_the_device() -> None:
    bench, _, recorder = active()
    bench.links[0].spoil = lambda packet: b""
    bench.run_for(PERIOD_US)
    bench.links[0].spoil = lambda packet: packet
    bench.run_for(4 * PERIOD_US)
    assert bench.announced() == [("PassiveError", "RTno0")]
    assert bench.states() == {"RTno0": "ERROR"}
    assert recorder.called == ["on_deactivated"]
    bench.manager.reset("RTno0")
    bench.run_for(PERIOD_US)
    bench.manager.activate("RTno0")
    bench.run_for(PERIOD_US)
    assert bench.states() == {"RTno0": "ACTIVE"}


def test_the_state_is_asked_in_place_of_a_ping() -> None:
    bench, _, _ = active()
    bench.manager.deactivate("RTno0")
    bench.run_for(PERIOD_US)
    bench.links[0].sent.clear()
    bench.run_for(5_000_000)
    assert {data for _, data in bench.links[0].sent} == {b"\n\nX\0X"}
    assert bench.events == []


def test_a_power_cut_is_found_and_the_device_is_found_again() -> None:
    bench, _, _ = active()
    bench.nodes[0].inputs.set("power_cut", 1)
    bench.run_for(3_000_000)
    bench.nodes[0].inputs.set("power_cut", 0)
    bench.run_for(2_000_000)
    assert [kind for kind, _ in bench.announced()] == ["FatalError", "Removed", "Rediscovered"]
    assert bench.states() == {"RTno0": "INACTIVE"}


def test_a_line_that_is_gone_is_a_lost_device() -> None:
    bench, _, _ = active()
    bench.links[0].close()
    bench.run_for(2_000_000)
    assert bench.states() == {}


def test_its_packets_have_one_kind_of_sum() -> None:
    with pytest.raises(ValueError, match="checksum is xor8, packets of RTno have sum8"):
        ProxySettings(framing=Framing.RTNO, checksum=Checksum.XOR8)
