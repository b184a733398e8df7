"""Nodes that were lost, and come back by themselves."""

from __future__ import annotations

from tests.emulators.can.can_bench import frames
from tests.host.rtc.canopen.bench import PALETTE_AND_MOTOR, Bench
from tickrig.host.rtc import LifeCycleState
from tickrig.host.rtc.canopen.events import ServerEventType

ACTIVE, ERROR, INACTIVE = LifeCycleState.ACTIVE, LifeCycleState.ERROR, LifeCycleState.INACTIVE
TWICE = PALETTE_AND_MOTOR.replace("f-palette.eds,", "f-palette.eds, restart: 2,")
TOLD = (ServerEventType.RESTARTED, ServerEventType.NOT_RESTARTED)


def running(text: str = TWICE, *active: int) -> Bench:
    bench = Bench(text)
    bench.boot()
    bench.run_ms(20)
    bench.activate(*(active or (16, 32)))
    return bench


def lose(bench: Bench, away_ms: int, then_ms: int = 800) -> None:
    bench.devices[16].physical["unplugged"].write(1)
    bench.run_ms(away_ms)
    bench.devices[16].physical["unplugged"].write(0)
    bench.run_ms(then_ms)


def test_a_node_that_was_away_for_a_moment_is_active_again() -> None:
    bench = running()
    lose(bench, 600)
    assert bench.events(*TOLD) == ["Restarted 16 1 of 2"]
    assert bench.state(16) is ACTIVE
    assert bench.devices[16].read("state") == "Operational"


def test_a_node_whose_proxy_was_removed_is_active_again() -> None:
    bench = running()
    lose(bench, 2_000)
    assert bench.events(*TOLD) == ["Restarted 16 1 of 2"]
    assert bench.state(16) is ACTIVE


def test_a_node_that_lost_its_power_for_a_moment_is_active_again() -> None:
    bench = running()
    bench.devices[16].physical["power_off"].write(1)
    bench.run_ms(50)
    bench.devices[16].physical["power_off"].write(0)
    bench.run_ms(800)
    assert bench.events(*TOLD) == ["Restarted 16 1 of 2"]
    assert bench.state(16) is ACTIVE


def test_a_node_that_was_inactive_is_inactive_again() -> None:
    bench = running(TWICE, 32)
    lose(bench, 600)
    assert bench.events(*TOLD) == ["Restarted 16 1 of 2"]
    assert bench.state(16) is INACTIVE


def test_after_its_last_restart_it_waits_for_somebody_who_resets_it() -> None:
    bench = running()
    for _ in range(3):
        lose(bench, 600)
    assert bench.events(*TOLD) == [
        "Restarted 16 1 of 2",
        "Restarted 16 2 of 2",
        "NotRestarted 16 Palette0 is in Error: reset and activate it; no restart is left",
    ]
    assert bench.state(16) is ERROR
    bench.server.manager.reset("Palette0")
    bench.run_ms(200)
    assert bench.state(16) is INACTIVE


def test_after_a_minute_all_restarts_are_there_again() -> None:
    bench = running()
    for _ in range(2):
        lose(bench, 600)
    bench.run_ms(60_000)
    lose(bench, 600)
    assert bench.events(*TOLD)[2:] == ["Restarted 16 1 of 2"]
    assert bench.state(16) is ACTIVE


def test_who_resets_it_before_it_is_back_finds_it_inactive() -> None:
    bench = running()
    bench.devices[16].physical["unplugged"].write(1)
    bench.run_ms(600)
    bench.server.manager.reset("Palette0")
    bench.run_ms(50)
    bench.devices[16].physical["unplugged"].write(0)
    bench.run_ms(800)
    assert bench.state(16) is INACTIVE


def test_a_node_that_another_master_stopped_stays_as_it_is() -> None:
    bench = running()
    bench.other.send(frames("000#0210"))
    bench.run_ms(800)
    assert bench.events(*TOLD) == []
    assert bench.state(16) is ERROR


def test_those_before_it_in_the_start_order_come_first() -> None:
    order = TWICE.replace("unit.eds,", "unit.eds, restart: 1,") + "start: {order: [32, 16]}\n"
    bench = running(order)
    for node_id in (16, 32):
        bench.devices[node_id].physical["unplugged"].write(1)
    bench.run_ms(600)
    before = len(bench.log.heard)
    for node_id in (16, 32):
        bench.devices[node_id].physical["unplugged"].write(0)
    bench.run_ms(1_000)
    starts = [str(heard) for _, heard in bench.log.heard[before:] if str(heard)[:6] == "000#01"]
    assert starts == ["000#0120", "000#0110"]
    assert (bench.state(16), bench.state(32)) == (ACTIVE, ACTIVE)


def test_a_node_without_restarts_is_left_to_a_person_and_it_is_told_what_to_do() -> None:
    bench = running(PALETTE_AND_MOTOR)
    lose(bench, 3_000)
    assert bench.state(16) is INACTIVE
    assert bench.events(*TOLD) == [
        "NotRestarted 16 Palette0 was Active and is Inactive now: activate it; 'restart: 3' of the"
        " node does so by itself"
    ]
    bench.activate(16)
    lose(bench, 600)
    assert bench.state(16) is ERROR
    assert bench.events(*TOLD)[1:] == [
        "NotRestarted 16 Palette0 is in Error: reset and activate it; 'restart: 3' of the node does"
        " so by itself"
    ]


def test_what_was_not_active_is_not_missed() -> None:
    bench = running(PALETTE_AND_MOTOR)
    bench.server.manager.deactivate("Palette0")
    bench.run_ms(200)
    lose(bench, 3_000)
    assert bench.state(16) is INACTIVE
    assert bench.events(*TOLD) == []


def test_a_node_that_is_activated_by_itself_is_not_told_of() -> None:
    bench = Bench(PALETTE_AND_MOTOR + "start: {autoactivate: true, order: [16, 32]}\n")
    bench.boot()
    bench.run_ms(500)
    assert bench.state(16) is ACTIVE
    lose(bench, 3_000)
    assert bench.state(16) is ACTIVE
    assert bench.events(*TOLD) == []
