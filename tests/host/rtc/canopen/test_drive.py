"""Drives: the CiA 402 sequence behind the life cycle; beego with two EPOS (K21)."""

from __future__ import annotations

import pytest

from tests.host.rtc.canopen.bench import SYSTEMS, Bench
from tests.host.rtc.canopen.components import add_knob, add_logger
from tickrig.host.rtc import LifeCycleState
from tickrig.host.rtc.canopen.events import ServerEventType
from tickrig.wire.rtc_types.rtc import Time, TimedLong

ACTIVE, ERROR, INACTIVE = LifeCycleState.ACTIVE, LifeCycleState.ERROR, LifeCycleState.INACTIVE
BEEGO = (
    (SYSTEMS / "beego.yaml").read_text("utf-8").partition("rt_connections:")[0]
    + """
rt_connections:
- {from: Knob0.out, to: Left.set_60FF_00}
- {from: Knob0.out, to: Right.set_60FF_00}
- {from: Left.get_6064_00, to: Logger0.in}
"""
)
WHEELS = {1: "epos", 2: "epos"}


def running() -> Bench:
    bench = Bench(BEEGO, WHEELS, SYSTEMS)
    bench.boot()
    bench.activate()
    assert (bench.state(1), bench.state(2)) == (ACTIVE, ACTIVE)
    return bench


def controlwords(bench: Bench) -> list[str]:
    """Return what was said to the left drive: NMT commands and controlwords."""
    texts = [str(heard) for _, heard in bench.log.heard]
    return [
        text[12:14] if text.startswith("601#2B406000") else text
        for text in texts
        if text.startswith("601#2B406000") or (text.startswith("000#") and text.endswith("01"))
    ]


def status(bench: Bench, node_id: int = 1) -> int:
    return bench.devices[node_id].slave.dictionary[0x6041, 0].number & 0x6F


def test_activation_starts_the_node_and_enables_the_drive_step_by_step() -> None:
    bench = running()
    assert controlwords(bench) == ["000#0101", "06", "07", "0F"]
    assert status(bench) == 0x27


def test_deactivation_disables_it_first() -> None:
    bench = running()
    bench.log.heard.clear()
    bench.server.manager.deactivate("Left")
    bench.run_ms(300)
    assert controlwords(bench) == ["07", "06", "000#8001"]
    assert (bench.state(1), bench.state(2)) == (INACTIVE, ACTIVE)


def test_a_velocity_is_sent_with_the_controlword_that_keeps_it_enabled() -> None:
    bench = running()
    knob = add_knob(bench.server.manager, TimedLong)
    logger = add_logger(bench.server.manager, TimedLong)
    bench.run_ms(20)
    knob.out.write(TimedLong(Time(), 600))
    bench.run_ms(500)
    assert "201#0F0058020000" in bench.log.text
    assert "202#0F0058020000" in bench.log.text
    speeds = [bench.devices[n].slave.dictionary[0x606C, 0].value for n in WHEELS]
    assert speeds == [pytest.approx(600, abs=3)] * 2
    positions = [value.data for _, value in logger.heard]
    assert positions[-1] > positions[0]


def test_a_command_before_the_drive_is_enabled_is_not_sent() -> None:
    bench = Bench(BEEGO, WHEELS, SYSTEMS)
    bench.boot()
    knob = add_knob(bench.server.manager, TimedLong)
    bench.server.manager.activate("Left")
    bench.run_ms(20)
    knob.out.write(TimedLong(Time(), 600))
    bench.run_ms(400)
    assert bench.state(1) is ACTIVE
    assert "201#" not in bench.log.text


def test_a_drive_that_does_not_enable_is_in_error() -> None:
    bench = Bench(BEEGO, WHEELS, SYSTEMS)
    bench.boot()
    bench.devices[1].physical["supply_v"].write(5.0)
    bench.run_ms(50)
    bench.server.manager.activate("Left")
    bench.run_ms(800)
    assert bench.state(1) is ERROR
    (event,) = bench.events(ServerEventType.NOT_CONFIRMED)
    assert "after controlword 0006h" in event


def test_reset_clears_the_fault_before_the_node_is_reset() -> None:
    bench = running()
    bench.server.manager.context_of("Left").abort_component(bench.server.manager.find("Left"))
    bench.run_ms(200)
    assert bench.state(1) is ERROR
    bench.log.heard.clear()
    bench.server.manager.reset("Left")
    bench.run_ms(400)
    assert controlwords(bench) == ["000#8001", "00", "80", "000#8101"]
    assert bench.state(1) is INACTIVE
    bench.activate(1)
    assert bench.state(1) is ACTIVE
