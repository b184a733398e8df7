"""Others on the bus: a second master, its commands, a second node of the same node-ID."""

from __future__ import annotations

import pytest

from tests.emulators.can.can_bench import frames
from tests.host.rtc.canopen.bench import Bench
from tickrig.host.rtc import LifeCycleState
from tickrig.host.rtc.canopen.events import ServerEventType
from tickrig.host.rtc.canopen.served_node import NodePhase

ACTIVE, ERROR, INACTIVE = LifeCycleState.ACTIVE, LifeCycleState.ERROR, LifeCycleState.INACTIVE


def running(models: dict[int, str] | None = None) -> Bench:
    bench = Bench(models=models)
    if models:
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
    assert bench.events(ServerEventType.FOREIGN_MASTER) == [
        "ForeignMaster 127 another node has the node-ID of the server"
    ]
    bench.run_ms(1_500)
    foreign(bench, "77F#05")
    assert len(bench.events(ServerEventType.FOREIGN_MASTER)) == 2


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
    assert bench.events(ServerEventType.FOREIGN_TRANSITION) == [f"ForeignTransition 16 {text}"]
    assert bench.state(16) is then
    assert sum(str(heard).startswith("000#") for _, heard in bench.log.heard) == sent + 1


def test_an_off_the_shelf_device_that_leaves_stopped_is_followed_out_of_error() -> None:
    bench = running()
    foreign(bench, "000#0210")
    foreign(bench, "000#0110", 500)
    assert bench.state(16) is ACTIVE
    assert bench.events(ServerEventType.FOREIGN_TRANSITION)[1:] == [
        "ForeignTransition 16 OPERATIONAL while the proxy is ERROR"
    ]


def test_a_command_of_another_master_is_told_of() -> None:
    bench = running()
    foreign(bench, "000#0110 000#0200 000#7710 000#01")
    assert bench.events(ServerEventType.FOREIGN_COMMAND) == [
        "ForeignCommand 16 START",
        "ForeignCommand 0 STOP to all",
        "ForeignCommand 16 77h",
    ]


def test_after_a_reset_by_another_master_the_node_is_set_up_again_at_once() -> None:
    bench = running()
    bench.activate(16)
    bench.other.send(frames("000#8110"))
    before_us = bench.now_us
    event = bench.run_until(ServerEventType.PROXY_MADE)
    assert event.at_us - before_us < 40_000
    assert bench.state(32) is INACTIVE


@pytest.mark.parametrize("active", [True, False])
def test_a_second_node_of_the_same_node_id_is_found_and_both_are_stopped(active: bool) -> None:
    bench = running({16: "f-palette", 32: "motor-core-unit", 1016: "f-palette"})
    if active:
        bench.activate(16)
    bench.run_ms(20 if active else 157)
    bench.devices[1016].physical["power_off"].write(0)
    event = bench.run_until(ServerEventType.DUPLICATE_NODE, within_ms=300)
    reason = "a boot-up, and heartbeats at the times of before"
    assert (event.node, event.text) == (16, f"both are stopped: {reason}")
    bench.run_ms(100)
    assert bench.server.nodes[16].phase is NodePhase.DUPLICATE
    assert bench.state(16) is ERROR
    assert [bench.devices[n].read("state") for n in (16, 1016)] == ["Stopped", "Stopped"]


def test_heartbeats_that_come_twice_as_often_are_a_suspicion_and_stop_nothing() -> None:
    bench = running()
    bench.activate(16)
    bench.run_ms(30)
    for _ in range(30):
        bench.other.send(frames("710#05"))
        bench.run_ms(100)
    assert bench.events(ServerEventType.DUPLICATE_SUSPECTED, ServerEventType.DUPLICATE_NODE) == [
        "DuplicateSuspected 16 two heartbeats in each 100 ms"
    ]
    assert bench.state(16) is ACTIVE
    assert "000#0210" not in bench.log.text


@pytest.mark.parametrize("busy_ms", [1_200, 5_000])
def test_heartbeats_that_a_device_sends_at_once_when_it_goes_on_show_no_second_node(
    busy_ms: int,
) -> None:
    bench = running()
    bench.activate(16)
    bench.devices[16].physical["unplugged"].write(1)
    bench.run_ms(busy_ms)
    bench.devices[16].physical["unplugged"].write(0)
    bench.other.send(frames("710#05 " * (busy_ms // 100)))
    bench.run_ms(2_000)
    assert bench.events(ServerEventType.DUPLICATE_NODE, ServerEventType.DUPLICATE_SUSPECTED) == []


def test_states_that_nobody_commanded_in_turn_show_a_second_node() -> None:
    bench = running()
    bench.activate(16)
    bench.server.nodes[16].dialogue.clear()
    for state in ("7F", "05", "7F", "05"):
        bench.other.send(frames(f"710#{state}"))
        bench.rig.run_for(2_000)
    bench.run_ms(50)
    (event,) = bench.events(ServerEventType.DUPLICATE_NODE)
    assert event.endswith("OPERATIONAL in turn with PRE_OPERATIONAL, uncommanded")
    assert bench.state(16) is ERROR


@pytest.mark.parametrize(
    ("answer", "found"),
    [
        ("4318100477000000", ["1018h:04 is 00000001h and 00000077h"]),
        ("4318100401000000", []),
        ("8018100400000206", []),
        ("4301140277000000", []),
    ],
)
def test_two_answers_for_its_identity_show_a_second_node(answer: str, found: list[str]) -> None:
    bench = Bench()
    bench.run_ms(20)
    assert "590#4318100401000000" in bench.log.text
    foreign(bench, f"590#{answer}")
    both = "DuplicateNode 16 both are stopped: "
    assert bench.events(ServerEventType.DUPLICATE_NODE) == [both + reason for reason in found]
    assert (bench.devices[16].read("state") == "Stopped") is bool(found)


def test_when_the_twins_are_gone_the_node_is_looked_for_again() -> None:
    bench = running({16: "f-palette", 32: "motor-core-unit", 1016: "f-palette"})
    bench.activate(16)
    bench.devices[1016].physical["power_off"].write(0)
    bench.run_until(ServerEventType.DUPLICATE_NODE)
    for number in (16, 1016):
        bench.devices[number].physical["power_off"].write(1)
    bench.run_ms(1_500)
    assert bench.server.nodes[16].phase is NodePhase.ABSENT
    bench.devices[16].physical["power_off"].write(0)
    bench.boot()


def test_twins_that_boot_together_and_differ_in_their_serial_number_alone_are_found() -> None:
    bench = Bench(models={16: "f-palette", 32: "motor-core-unit", 1016: "f-palette"})
    bench.devices[1016].slave.dictionary[0x1018, 4].value = 2
    bench.run_ms(500)
    assert bench.events(ServerEventType.DUPLICATE_NODE) == [
        "DuplicateNode 16 both are stopped: 1018h:04 is 00000001h and 00000002h"
    ]
    assert [bench.devices[n].read("state") for n in (16, 1016)] == ["Stopped", "Stopped"]
    assert bench.state(32) is INACTIVE


def test_an_emergency_is_told_of_and_noise_is_not() -> None:
    bench = running()
    foreign(
        bench, "090#3081110000000000 090#4081110000000000 090#00 710# 710#55 590#FF 7A1#05 7A0#01"
    )
    assert bench.events(ServerEventType.EMERGENCY, ServerEventType.BUS_OFF) == [
        "Emergency 16 8130h life guard error or heartbeat error, error register 11h",
        "BusOff 16 8140h recovered from bus off, error register 11h",
    ]
    assert bench.state(16) is INACTIVE
