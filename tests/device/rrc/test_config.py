from __future__ import annotations

import pytest

from tests.device.rrc.bench import RrcBench
from tickrig.device.rrc.settings import FailTarget, RrcConfig


def test_the_power_on_event_can_be_that_of_the_manuals_table() -> None:
    bench = RrcBench(RrcConfig(power_on_event="PowerOn")).boot()
    assert bench.tap("power_button") == ["EV:PowerOn"]


def test_another_power_on_event_is_refused() -> None:
    with pytest.raises(ValueError, match="'Hello' is not one of"):
        RrcConfig(power_on_event="Hello")


def test_a_time_below_one_tick_is_refused() -> None:
    with pytest.raises(ValueError, match="power_on_ticks is 0, at least 1"):
        RrcConfig(power_on_ticks=0)


def test_initialize_can_last_longer() -> None:
    bench = RrcBench(RrcConfig(initialize_ticks=3))
    assert [bench.step() for _ in range(3)] == [[], [], ["EV:Initialized"]]


def test_a_failed_power_on_can_lead_through_initialize() -> None:
    bench = RrcBench(RrcConfig(power_on_fail_target=FailTarget.INITIALIZE)).boot()
    bench.step("speedmode40")
    bench.set(joystick_fault=1)
    bench.tap("power_button")
    assert bench.run(30) == ["EV:PowerOnError1", "EV:Initialized"]
    assert bench.rrc.read("speed_mode") == 1


def test_overtime_can_be_switched_off() -> None:
    bench = RrcBench(RrcConfig(overtime=False)).enter("Output")
    bench.set(extra_load_pct=1_000)
    assert bench.run(50) == []
    assert bench.state == "Output"


def test_answers_can_be_those_of_another_device() -> None:
    bench = RrcBench(RrcConfig(device_name="RRC2", version="Version 2", date="today")).power_on()
    lines = bench.step("device", "version") + bench.step("date")
    assert [line for line in lines if not line.startswith("OK")] == ["RRC2", "Version 2", "today"]
