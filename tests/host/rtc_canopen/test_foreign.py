"""Others on the bus: a second master, its commands, a second node of the same node-ID."""

from __future__ import annotations

import pytest

from tests.emulators.can_bench import frames
from tests.host.rtc_canopen.bench import Bench
from tickrig.host.rtc import LifeCycleState
from tickrig.host.rtc_canopen.events import EventKind
from tickrig.host.rtc_canopen.served_node import Phase

ACTIVE, ERROR, INACTIVE = LifeCycleState.ACTIVE, LifeCycleState.ERROR, LifeCycleState.INACTIVE


def running(cast: dict[int, str] | None = None) -> Bench:
    bench = Bench(cast=cast)
    if cast:
        for number, device in bench.devices.items():
            device.physical["power_off"].write(int(number > 127))
    bench.boot()
    bench.run_ms(20)
    return bench


def foreign(bench: Bench, text: str, then_ms: int = 300) -> None:
    bench.other.send(frames(text))
    bench.run_ms(then_ms)


def test_another_master_is_told_of_once_while_it_is_heard() -> None:
    bench = running()
    for _ in range(5):
        foreign(bench, "77F#05", 100)
    assert bench.events(EventKind.FOREIGN_MASTER) == [
        "ForeignMaster 127 another node has the node-ID of the server"
    ]
    bench.run_ms(1_500)
    foreign(bench, "77F#05")
    assert len(bench.events(EventKind.FOREIGN_MASTER)) == 2


@pytest.mark.parametrize(
    ("active", "command", "text", "then"),
    [
        (False, "0110", "OPERATIONAL while the proxy is INACTIVE", ACTIVE),
        (False, "0210", "STOPPED while the proxy is INACTIVE", ERROR),
        (True, "8010", "PRE_OPERATIONAL while the proxy is ACTIVE", INACTIVE),
        (True, "0210", "STOPPED while the proxy is ACTIVE", ERROR),
    ],
)
def test_the_proxy_follows_a_command_of_another_master(
    active: bool, command: str, text: str, then: LifeCycleState
) -> None:
    bench = running()
    if active:
        bench.activate(16)
    sent = sum(str(heard).startswith("000#") for _, heard in bench.log.heard)
    foreign(bench, f"000#{command}")
    assert bench.events(EventKind.FOREIGN_TRANSITION) == [f"ForeignTransition 16 {text}"]
    assert bench.state(16) is then
    assert sum(str(heard).startswith("000#") for _, heard in bench.log.heard) == sent + 1


def test_an_off_the_shelf_device_that_leaves_stopped_is_followed_out_of_error() -> None:
    bench = running()
    foreign(bench, "000#0210")
    foreign(bench, "000#0110", 500)
    assert bench.state(16) is ACTIVE
    assert bench.events(EventKind.FOREIGN_TRANSITION)[1:] == [
        "ForeignTransition 16 OPERATIONAL while the proxy is ERROR"
    ]


def test_a_command_of_another_master_is_told_of() -> None:
    bench = running()
    foreign(bench, "000#0110 000#0200 000#7710 000#01")
    assert bench.events(EventKind.FOREIGN_COMMAND) == [
        "ForeignCommand 16 START",
        "ForeignCommand 0 STOP to all",
        "ForeignCommand 16 77h",
    ]


def test_after_a_reset_by_another_master_the_node_is_set_up_again_at_once() -> None:
    bench = running()
    bench.activate(16)
    bench.other.send(frames("000#8110"))
    before_us = bench.now_us
    event = bench.run_until(EventKind.PROXY_MADE)
    assert event.at_us - before_us < 40_000
    assert bench.state(32) is INACTIVE


@pytest.mark.parametrize("active", [True, False])
def test_a_second_node_of_the_same_node_id_is_found_and_both_are_stopped(active: bool) -> None:
    bench = running({16: "f-palette", 32: "motor-core-unit", 1016: "f-palette"})
    if active:
        bench.activate(16)
    bench.run_ms(20 if active else 57)
    bench.devices[1016].physical["power_off"].write(0)
    event = bench.run_until(EventKind.DUPLICATE_NODE, within_ms=300)
    assert (event.node, event.text) == (16, "both are stopped")
    bench.run_ms(100)
    assert bench.server.nodes[16].phase is Phase.DUPLICATE
    assert bench.state(16) is ERROR
    assert [bench.devices[n].read("state") for n in (16, 1016)] == ["Stopped", "Stopped"]


def test_heartbeats_that_come_twice_as_often_show_a_second_node() -> None:
    bench = running()
    bench.run_ms(30)
    for _ in range(20):
        bench.other.send(frames("710#7F"))
        bench.run_ms(100)
    assert len(bench.events(EventKind.DUPLICATE_NODE)) == 1


def test_heartbeats_that_are_read_at_once_show_no_second_node() -> None:
    bench = running()
    for busy_ms in (150, 250, 290, 800, 2_000) * 4:
        bench.rig.run_for(1_000 * busy_ms)
        bench.run_ms(30)
    assert bench.events(EventKind.DUPLICATE_NODE, EventKind.HEARTBEAT_LOST) == []


def test_when_the_twins_are_gone_the_node_is_looked_for_again() -> None:
    bench = running({16: "f-palette", 32: "motor-core-unit", 1016: "f-palette"})
    bench.activate(16)
    bench.devices[1016].physical["power_off"].write(0)
    bench.run_until(EventKind.DUPLICATE_NODE)
    for number in (16, 1016):
        bench.devices[number].physical["power_off"].write(1)
    bench.run_ms(1_500)
    assert bench.server.nodes[16].phase is Phase.ABSENT
    bench.devices[16].physical["power_off"].write(0)
    bench.boot()


def test_an_emergency_is_told_of_and_noise_is_not() -> None:
    bench = running()
    foreign(
        bench, "090#3081110000000000 090#4081110000000000 090#00 710# 710#55 590#FF 7A1#05 7A0#01"
    )
    assert bench.events(EventKind.EMERGENCY, EventKind.BUS_OFF) == [
        "Emergency 16 8130h life guard error or heartbeat error, error register 11h",
        "BusOff 16 8140h recovered from bus off, error register 11h",
    ]
    assert bench.state(16) is INACTIVE
