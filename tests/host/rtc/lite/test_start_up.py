"""Start-up of a proxy: what leads to Inactive, and what is refused."""

from __future__ import annotations

import pytest

from tests.host.rtc.lite.bench import Bench
from tests.host.rtc.lite.scripted_node import ScriptedNode
from tickrig.device.rtc_lite.component import LiteComponent, LiteEcho, LiteInPort, LiteOutPort
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.host.rtc import ExecutionContext, Manager, ReturnCode, RtcRefused
from tickrig.host.rtc.lite import ProxySettings, RtcLiteProxy, attach
from tickrig.wire.rtc_lite.codes import LiteCommand
from tickrig.wire.rtc_lite.frame import Checksum, LiteFrame
from tickrig.wire.rtc_lite.values import LONG

EC = ExecutionContext()


@pytest.mark.parametrize(
    ("state", "asked"),
    [
        ("Created", ["CX", "CZ", "BB", "CI"]),
        ("Inactive", ["CX", "CZ", "BB"]),
        ("Active", ["CX", "AD", "CZ", "BB"]),
        ("Error", ["CX", "AR", "CZ", "BB"]),
    ],
)
def test_a_start_up_begins_from_any_state(state: str, asked: list[str]) -> None:
    link = ScriptedNode()
    earlier = RtcLiteProxy("Echo0", link)
    if state != "Created":
        earlier.on_initialize()
    if state in {"Active", "Error"}:
        earlier.on_activated(EC)
    if state == "Error":
        earlier.on_aborting(EC)
    link.taken()
    proxy = RtcLiteProxy("Echo1", link)
    assert proxy.initialize() is ReturnCode.RTC_OK
    assert link.taken() == asked
    assert link.node.read("state") == "Inactive"


def test_a_profile_says_what_the_device_is() -> None:
    proxy = RtcLiteProxy("Echo0", ScriptedNode())
    assert proxy.profile.properties == {}
    proxy.initialize()
    assert proxy.profile.properties == {
        "rtc_lite.type_name": "Echo0",
        "rtc_lite.context": "0x21",
        "rtc_lite.pings": "0 sent, 0 answered, 0 lost",
    }
    assert [port.name for port in proxy.profile.port_profiles] == ["Echo0.in", "Echo0.out"]


@pytest.mark.parametrize("noise", [b"\nZz", b"\nAA", b"\nPS\x02", b"\nPS\x0f\x2d", b"\n"])
def test_half_a_frame_that_was_on_the_line_before_does_not_prevent_a_start_up(
    noise: bytes,
) -> None:
    bench = Bench(LiteEcho)
    bench.links[0].send(noise)
    bench.rig.run_for(10_000)
    bench.attach(0, "Echo")
    assert bench.nodes[0].read("state") == "Inactive"


def test_questions_are_asked_4_times() -> None:
    link = ScriptedNode()
    link.answers[LiteCommand.STATE] = []
    assert RtcLiteProxy("Echo0", link).initialize() is ReturnCode.RTC_ERROR
    assert link.taken() == ["CX"] * 4
    assert link.now_us == 400_000


@pytest.mark.parametrize(
    ("command", "data", "text"),
    [
        (LiteCommand.STATE, None, "no reply to CX"),
        (LiteCommand.PROFILE, None, "no reply to CZ"),
        (LiteCommand.PROFILE, b"!", "CZ was refused with 0x21"),
        (
            LiteCommand.PROFILE,
            b"@\1\0\4Echo",
            "1 in-ports and 0 out-ports announced, 0 and 0 described",
        ),
        (LiteCommand.CONTEXT, None, "no reply to BB"),
        (LiteCommand.CONTEXT, b"@\x23", "execution context 0x23, 0x21 and 0x22 are known"),
        (LiteCommand.INITIALIZE, b"xC", "CI was refused with 0x78"),
        (LiteCommand.INITIALIZE, b"@E", "the state of the device is ERROR, not INACTIVE"),
        (LiteCommand.STATE, b"@?", "the state of the device is unknown, not INACTIVE"),
        (LiteCommand.STATE, b"@N", "the state of the device is NONE, not INACTIVE"),
    ],
)
def test_what_is_in_the_way_is_said(
    command: LiteCommand, data: bytes | None, text: str, caplog: pytest.LogCaptureFixture
) -> None:
    link = ScriptedNode()
    link.answers[command] = [] if data is None else [LiteFrame(command, data)]
    assert RtcLiteProxy("Echo0", link).initialize() is ReturnCode.RTC_ERROR
    assert f"Echo0: no start-up: {text}" in caplog.text


def test_after_a_failed_start_up_another_one_may_be_tried() -> None:
    link = ScriptedNode()
    link.answers[LiteCommand.INITIALIZE] = []
    proxy = RtcLiteProxy("Echo0", link)
    assert proxy.initialize() is ReturnCode.RTC_ERROR
    link.answers.clear()
    assert proxy.initialize() is ReturnCode.RTC_OK
    assert list(proxy.ports) == ["in", "out"]


def test_two_ports_of_one_name_are_refused(caplog: pytest.LogCaptureFixture) -> None:
    class Twins(LiteComponent):
        type_name = "Twins"
        inlet = LiteInPort("x", LONG)
        outlet = LiteOutPort("x", LONG)

    bench = Bench(Twins)
    with pytest.raises(RtcRefused, match="on_initialize of Twins0 returned RTC_ERROR"):
        bench.attach(0, "Twins")
    assert "Twins0 has a port 'x' already" in caplog.text
    assert bench.manager.components == ()


def test_ports_of_a_failed_start_up_are_made_anew() -> None:
    link = ScriptedNode()
    port = LiteFrame(LiteCommand.IN_PROFILE, b"\3lin")
    link.answers[LiteCommand.PROFILE] = [port, port, LiteFrame(LiteCommand.PROFILE, b"@\2\0\1E")]
    proxy = RtcLiteProxy("Echo0", link)
    assert proxy.initialize() is ReturnCode.RTC_ERROR
    link.answers.clear()
    assert proxy.initialize() is ReturnCode.RTC_OK
    assert list(proxy.ports) == ["in", "out"]


def test_a_board_that_boots_is_waited_for() -> None:
    bench = Bench(LiteEcho)
    bench.attach(0, "Echo", ProxySettings(boot_us=3_000_000))
    assert bench.links[0].sent[0][0] == 3_000_000


def test_parity_in_place_of_a_sum() -> None:
    bench = Bench(LiteEcho, config=LiteConfig(checksum=Checksum.XOR8))
    proxy = bench.attach(0, "Echo", ProxySettings(checksum=Checksum.XOR8))
    assert proxy.device is not None
    assert proxy.device.type_name == "Echo0"


def test_a_profile_at_300_bit_s_takes_its_time() -> None:
    bench = Bench(LiteEcho, baud=300)
    proxy = bench.attach(0, "Echo", ProxySettings(reply_us=500_000))
    assert list(proxy.ports) == ["in", "out"]
    assert bench.rig.now_us > 2_000_000


def test_a_profile_without_end_ends_after_10_s() -> None:
    class Endless(ScriptedNode):
        def receive(self, timeout_us: int, /) -> bytes:
            if self.requests[-1:] == ["CZ"]:
                self.now_us += 50_000
                self.come(LiteFrame(LiteCommand.IN_PROFILE, b"\3lin"))
            return super().receive(timeout_us)

    link = Endless()
    link.answers[LiteCommand.PROFILE] = []
    assert RtcLiteProxy("Echo0", link).initialize() is ReturnCode.RTC_ERROR
    assert 40_000_000 <= link.now_us < 41_000_000  # 4 times


def test_a_line_that_is_gone_is_no_reply() -> None:
    bench = Bench(LiteEcho)
    bench.links[0].close()
    with pytest.raises(RtcRefused, match="on_initialize of Echo0 returned RTC_ERROR"):
        attach(Manager(), bench.links[0], "Echo")


@pytest.mark.parametrize(
    "name", ["boot_us", "reply_us", "ping_period_us", "pings", "linger_us", "search_period_us"]
)
def test_a_setting_that_is_too_small_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=f"{name} is -1, at least [01] is needed"):
        ProxySettings(**{name: -1})  # type: ignore[arg-type] # a name that mypy does not know
