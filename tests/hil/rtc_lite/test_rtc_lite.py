"""A node of RTC-Lite: its life cycle, its ports, and what it says of what it cannot read."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hil.line_host import PATIENCE, LineHost
from tests.hil.rigs import RIGS
from tickrig import Bench
from tickrig.wire.rtc_lite.codes import LiteCommand, LiteState, LiteStatus
from tickrig.wire.rtc_lite.frame import REPLIES, LiteDecoder, LiteFrame
from tickrig.wire.rtc_lite.messages import LitePortData, LiteReply, parse_reply
from tickrig.wire.rtc_lite.values import LONG

pytestmark = pytest.mark.needs("device:rtc_lite")


@pytest.fixture
def bench_config() -> Path:
    return RIGS / "rtc_lite.toml"


class Host(LineHost):
    """A host that sends requests and reads frames."""

    def __init__(self, bench: Bench) -> None:
        super().__init__(bench)
        self._decoder = LiteDecoder(REPLIES)
        self.frames: list[LiteFrame] = []

    def request(self, command: LiteCommand, data: bytes = b"") -> LiteReply:
        """Send a request; return its reply."""
        self.frames.clear()
        self.send(LiteFrame(command, data).encode())
        return parse_reply(self.frame(command))

    def frame(self, command: LiteCommand) -> LiteFrame:
        """Wait for a frame with a command."""
        assert self.bench.wait_until(lambda: bool(self._of(command)), within=PATIENCE)
        return self._of(command)[0]

    def _of(self, command: LiteCommand) -> list[LiteFrame]:
        data, self.heard = self.listen(), b""
        self.frames += [each for each in self._decoder.push(data) if isinstance(each, LiteFrame)]
        return [each for each in self.frames if each.command is command]


@pytest.fixture
def host(bench: Bench) -> Host:
    bench.run_for("100ms")
    return Host(bench)


@pytest.fixture
def active(host: Host) -> Host:
    """A node whose component is active."""
    for command in (LiteCommand.INITIALIZE, LiteCommand.ACTIVATE):
        assert host.request(command).ok
    return host


def state(host: Host) -> LiteState:
    return LiteState(host.request(LiteCommand.STATE).fields[0])


def test_it_waits_to_be_initialized(host: Host) -> None:
    assert state(host) is LiteState.CREATED
    assert host.request(LiteCommand.ACTIVATE).status == LiteStatus.WRONG_STATE


def test_it_is_led_through_its_life(active: Host) -> None:
    assert state(active) is LiteState.ACTIVE
    assert active.request(LiteCommand.DEACTIVATE).ok
    assert state(active) is LiteState.INACTIVE
    assert active.request(LiteCommand.FINALIZE).ok


def test_what_goes_in_comes_out(active: Host) -> None:
    for number in (1, -5, 2_147_483_647):
        data = LitePortData(b"in", LONG.encode(number)).encode()
        assert active.request(LiteCommand.WRITE, data).ok
        assert active.request(LiteCommand.EXECUTE).ok
        assert active.frame(LiteCommand.DATA).data.endswith(LONG.encode(number))


def test_a_port_that_is_not_there_is_told(active: Host) -> None:
    data = LitePortData(b"nowhere", LONG.encode(1)).encode()
    assert active.request(LiteCommand.WRITE, data).status == LiteStatus.NO_IN_PORT


def test_a_ping_comes_back(host: Host) -> None:
    for number in (0, 1, 255):
        assert host.request(LiteCommand.PING, bytes([number])).fields == bytes([number])


def test_a_wrong_checksum_is_told_and_forgotten(host: Host) -> None:
    frame = bytearray(LiteFrame(LiteCommand.STATE).encode())
    frame[-1] ^= 0x01
    host.send(bytes(frame))
    host.frame(LiteCommand.CHECKSUM_FAULT)
    assert state(host) is LiteState.CREATED


def test_a_frame_that_breaks_off_is_told_and_forgotten(host: Host) -> None:
    host.send(LiteFrame(LiteCommand.STATE).encode()[:2])
    host.bench.run_for("300ms")
    host.frame(LiteCommand.TIMEOUT_FAULT)
    assert state(host) is LiteState.CREATED


@pytest.mark.needs("fault:power_cut")
def test_it_forgets_all_in_a_power_cut(active: Host) -> None:
    active.bench.fault("power_cut", for_="200ms")
    active.bench.run_for("400ms")
    assert state(active) is LiteState.CREATED


@pytest.mark.needs("input:callback_ms")
def test_a_slow_callback_answers_late(active: Host) -> None:
    active.bench.set("callback_ms", 300)
    begun_us = active.bench.now_us
    assert active.request(LiteCommand.DEACTIVATE).ok
    assert active.bench.now_us - begun_us >= 290_000
    active.bench.set("callback_ms", 0)


@pytest.mark.needs("fault:ping")
def test_a_node_that_answers_no_ping_is_seen(host: Host) -> None:
    host.bench.fault("ping=1")
    host.send(LiteFrame(LiteCommand.PING, b"\x01").encode())
    host.bench.run_for("300ms")
    assert not host._of(LiteCommand.PING)
    host.bench.clear("ping")
    assert host.request(LiteCommand.PING, b"\x02").ok
