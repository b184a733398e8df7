"""Interpolated position mode of an EPOS with its wheel; a SYNC each 10 ms."""

from __future__ import annotations

import pytest

from tests.device.canopen.ds402.wheel import BIT_12, REACHED, RPM, Wheel
from tickrig.device.canopen.dictionary import SdoAbort

ENABLE, DISABLE, HALT = 0x1F, 0x0F, 0x11F
PERIOD_MS = 10


@pytest.fixture
def wheel() -> Wheel:
    wheel = Wheel()
    wheel.write(0x60C2, PERIOD_MS, 1)
    wheel.enable(7)
    return wheel


def cycle(wheel: Wheel, record: int) -> list[int]:
    """Give a record and a SYNC, run for a period; return the demanded positions."""
    wheel.write(0x60C1, record, 1)
    wheel.step("080#")
    demands = [wheel.read(0x6062)]
    for _ in range(PERIOD_MS - 1):
        wheel.step()
        demands.append(wheel.read(0x6062))
    return demands


def test_between_two_syncs_the_demand_is_a_straight_line(wheel: Wheel) -> None:
    wheel.control(ENABLE)
    assert cycle(wheel, 100) == [10 * step for step in range(1, 11)]
    assert cycle(wheel, 150) == [100 + 5 * step for step in range(1, 11)]
    assert cycle(wheel, -150) == [150 - 30 * step for step in range(1, 11)]


def test_the_motor_follows_a_parabola_of_records(wheel: Wheel) -> None:
    wheel.control(ENABLE)
    for number in range(1, 51):
        cycle(wheel, 20 * number**2)
    assert abs(wheel.read(0x6064) - 50_000) < 100
    cycle(wheel, 50_000)
    wheel.run(300)
    assert wheel.read(0x6064) == pytest.approx(50_000, abs=4)


def test_bit_12_says_that_it_interpolates(wheel: Wheel) -> None:
    assert wheel.bits == 0
    assert wheel.control(ENABLE) & BIT_12
    assert wheel.control(DISABLE) & BIT_12 == 0
    assert wheel.control(ENABLE) & BIT_12
    assert wheel.control(HALT) & BIT_12 == 0


def test_records_do_nothing_before_it_is_enabled(wheel: Wheel) -> None:
    assert cycle(wheel, 100) == [0] * 10
    wheel.control(ENABLE)
    wheel.run(10)
    assert wheel.read(0x6062) == 0
    assert cycle(wheel, 100)[-1] == 100


def test_to_enable_it_moves_nothing(wheel: Wheel) -> None:
    wheel.write(0x607A, 0)
    wheel.write(0x6060, 1)
    wheel.write(0x607A, 5_000)
    wheel.control(0x1F, 0x0F)
    wheel.run_until(lambda: bool(wheel.bits & REACHED))
    wheel.write(0x6060, 7)
    wheel.control(ENABLE)
    wheel.step("080#")
    wheel.run(20)
    assert (wheel.read(0x60C1, 1), wheel.read(0x6062)) == (5_000, 5_000)


def test_a_sync_wakes_only_an_enabled_drive() -> None:
    wheel = Wheel()
    wheel.run(100)
    due_us = wheel.slave.due_us
    assert due_us > wheel.now_us + 1_000
    assert wheel.step("080#") == []
    assert wheel.slave.due_us == due_us


def test_without_a_sync_the_line_ends_at_its_record(wheel: Wheel) -> None:
    wheel.control(ENABLE)
    cycle(wheel, 1_000)
    assert wheel.bits == BIT_12
    wheel.run(5)
    assert (wheel.read(0x6062), wheel.read(0x606B)) == (1_000, 0)
    assert wheel.bits == BIT_12 | REACHED


def test_disabled_in_motion_it_brakes_with_the_profile_deceleration(wheel: Wheel) -> None:
    wheel.control(ENABLE)
    for number in range(1, 11):
        cycle(wheel, 500 * number)
    speed_rpm = 500 / 0.010 / RPM
    wheel.control(DISABLE)
    assert wheel.read(0x606B) == pytest.approx(speed_rpm - 10_000 / 1_000, abs=1)
    wheel.run(int(speed_rpm / 10) + 1)
    assert wheel.read(0x606B) == 0


def test_after_halt_the_next_record_begins_a_line_from_there(wheel: Wheel) -> None:
    wheel.control(ENABLE)
    for number in range(1, 11):
        cycle(wheel, 500 * number)
    wheel.control(HALT)
    wheel.run(300)
    assert wheel.bits == REACHED
    stopped = wheel.read(0x6062)
    wheel.control(ENABLE)
    wheel.run(20)
    assert wheel.read(0x6062) == stopped
    demands = cycle(wheel, stopped + 100)
    assert demands == [stopped + 10 * step for step in range(1, 11)]


def test_a_record_beyond_a_software_limit_ends_there(wheel: Wheel) -> None:
    wheel.write(0x607D, -100, 1)
    wheel.write(0x607D, 300, 2)
    wheel.control(ENABLE)
    assert cycle(wheel, 1_000)[-1] == 300


@pytest.mark.parametrize("sub_mode", [-2, -1, 1])
def test_other_sub_modes_are_refused(wheel: Wheel, sub_mode: int) -> None:
    with pytest.raises(SdoAbort, match="VALUE_RANGE"):
        wheel.write(0x60C0, sub_mode)
