"""A server that looks late, and nodes that are silent: who is to blame."""

from __future__ import annotations

import pytest

from tests.host.rtc.canopen.bench import PALETTE_AND_MOTOR, Bench
from tickrig.emulators.can.outside.host import CanHost
from tickrig.host.links.link import StampedFrames
from tickrig.host.rtc import LifeCycleState
from tickrig.host.rtc.canopen.events import ServerEventType

ACTIVE, ERROR, INACTIVE = LifeCycleState.ACTIVE, LifeCycleState.ERROR, LifeCycleState.INACTIVE
BLAMED = (
    ServerEventType.HEARTBEAT_LOST,
    ServerEventType.DUPLICATE_NODE,
    ServerEventType.DUPLICATE_SUSPECTED,
)


class Unstamped(CanHost):
    """A driver without time stamps: a frame is of when it is read."""

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        now_us, received = super().receive_stamped(timeout_us)
        return now_us, tuple((now_us, frame) for _, frame in received)


class StoppedInBetween(CanHost):
    """The process is stopped after it has looked, each time for so long."""

    stop_us = 0

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        now_us, received = super().receive_stamped(timeout_us)
        self._rig.run_for(self.stop_us)
        return now_us, received


def running(text: str = PALETTE_AND_MOTOR) -> Bench:
    bench = Bench(text)
    bench.boot()
    bench.activate()
    return bench


def stop_server(bench: Bench, duration_ms: int) -> None:
    """Let the bus go on without the server."""
    bench.rig.run_for(1_000 * duration_ms)


@pytest.mark.parametrize("stamped", [True, False])
def test_a_server_that_was_stopped_says_so_and_blames_nobody(stamped: bool) -> None:
    bench = running()
    if not stamped:
        bench.link = Unstamped(bench.rig, bench.end)
    for busy_ms in (150, 250, 290, 800, 1_200, 20_000):
        stop_server(bench, busy_ms)
        bench.run_ms(1_100)
    assert bench.events(*BLAMED) == []
    assert (bench.state(16), bench.state(32)) == (ACTIVE, ACTIVE)
    late = bench.events(ServerEventType.SERVER_LATE)
    assert [int(event.split()[3]) // 10 for event in late] == [14, 24, 28, 79, 119, 1999]


def test_a_server_that_is_late_all_the_time_says_so_once_a_second() -> None:
    bench = running()
    for busy_ms in (150, 400) * 5:
        stop_server(bench, busy_ms)
        bench.run_ms(1)
    late = bench.events(ServerEventType.SERVER_LATE)
    assert len(late) == 3
    assert late[1].endswith("late")
    assert int(late[1].split()[3]) > 380


@pytest.mark.parametrize("stop_ms", [50, 350])
def test_a_stop_after_a_look_makes_no_silence(stop_ms: int) -> None:
    bench = running()
    bench.link = link = StoppedInBetween(bench.rig, bench.end)
    link.stop_us = 1_000 * stop_ms
    bench.run_ms(5_000)
    assert bench.events(*BLAMED) == []


def test_frames_that_were_lost_while_the_server_did_not_look_are_no_silence() -> None:
    bench = running()
    stop_server(bench, 1_200)
    bench.end.poll(bench.now_us)
    bench.run_ms(1_000)
    assert bench.events(*BLAMED) == []


def test_a_silent_node_is_told_from_a_server_that_did_not_look() -> None:
    bench = running()
    bench.run_ms(50)
    stop_server(bench, 20)
    bench.devices[16].physical["unplugged"].write(1)
    event = bench.run_until(ServerEventType.HEARTBEAT_LOST)
    assert (event.node, event.text) == (16, "silent for 300 ms")
    bench.devices[32].physical["unplugged"].write(1)
    stop_server(bench, 1_200)
    back_us = bench.now_us
    event = bench.run_until(ServerEventType.HEARTBEAT_LOST)
    assert event.node == 32
    assert event.at_us == back_us + 300_000
    silent_ms, blind_ms = (int(word) for word in event.text.split() if word.isdecimal())
    assert event.text.endswith(" ms of them the server did not look")
    assert 1_500 <= silent_ms <= 1_600
    assert 1_190 <= blind_ms <= 1_200


def test_an_answer_that_waits_while_the_server_is_stopped_is_in_time() -> None:
    bench = Bench()
    bench.run_ms(5)
    for _ in range(3):
        stop_server(bench, 2_000)
        bench.run_ms(1)
    bench.boot()
    assert bench.events(ServerEventType.SDO_TIMEOUT) == []


def test_a_heartbeat_counts_from_when_it_was_on_the_bus() -> None:
    bench = running()
    stop_server(bench, 180)
    bench.run_ms(0.1)
    last_us = max(at for at, received in bench.log.heard if str(received) == "710#05")
    assert bench.server.nodes[16].received_us == last_us
