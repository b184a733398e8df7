from __future__ import annotations

from itertools import pairwise
from math import radians

import pytest

from tests.device.canopen.fig120 import POTENTIOMETER
from tests.device.canopen.motor_core_unit.bench import (
    ANGLE,
    CURRENT,
    FAULT,
    FREE,
    LIMITED,
    ON,
    PRE_OPERATIONAL,
    REACHED,
    RESET,
    START,
    STOP,
    VELOCITY,
    UnitBench,
)
from tickrig.device.canopen.dictionary import SdoAbort
from tickrig.wire.instant import NEVER

ENCODER_DEG = 360 / 409_600
"""A count of the motor encoder, at the shaft."""


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("reference", "angle_deg"), [(row["ai16"], row["angle_deg"]) for row in POTENTIOMETER]
)
def test_an_angle_is_exact_to_the_digits_and_the_shaft_settles_on_it(
    bench: UnitBench, reference: int, angle_deg: float
) -> None:
    bench.begin(ANGLE, reference)
    assert round(bench.see("target_deg"), 4) == angle_deg
    bench.pass_ms(1_500)
    assert bench.see("angle_deg") == pytest.approx(angle_deg, abs=2 * ENCODER_DEG)
    assert bench.read(0x6401, 1) == pytest.approx(reference, abs=1)
    assert bench.status == ON | REACHED


def test_an_angle_is_reached_after_the_time_of_the_trapezoid(bench: UnitBench) -> None:
    bench.begin(ANGLE)
    bench.pass_ms(500)
    bench.refer(16384)
    bench.pass_ms(340)
    assert bench.status == ON
    bench.pass_ms(20)
    assert bench.status == ON | REACHED


def test_the_shaft_follows_the_planned_motion(bench: UnitBench) -> None:
    bench.begin(ANGLE, 32760)
    behind = []
    for _ in range(60):
        bench.pass_ms(10)
        since_us = bench.now_us - bench.unit._begin_us
        planned_deg, _, _ = bench.unit._motion._trajectory.at(since_us)
        behind.append(abs(bench.see("angle_deg") - planned_deg))
    assert max(behind) < 0.1


@pytest.mark.unmeasured
def test_the_velocity_limit_holds_in_angle_mode(bench: UnitBench) -> None:
    bench.begin(ANGLE)
    bench.refer(32767, velocity_limit=8192)
    seen = []
    for _ in range(300):
        bench.pass_ms(10)
        seen.append(bench.see("velocity_deg_s"))
    assert max(seen) == pytest.approx(90, rel=0.05)
    assert bench.see("angle_deg") == pytest.approx(180, abs=2 * ENCODER_DEG)


def test_the_angle_offset_moves_the_zero(bench: UnitBench) -> None:
    bench.write(0x2011, 30_000)
    bench.begin(ANGLE, 8192)
    bench.pass_ms(1_000)
    assert bench.see("angle_deg") == pytest.approx(75.0014, abs=2 * ENCODER_DEG)
    assert bench.read(0x6401, 1) == pytest.approx(8192, abs=1)


def test_a_full_scale_scales_references_and_measurements(bench: UnitBench) -> None:
    bench.write(0x2010, 90_000, sub=1)
    bench.begin(ANGLE, 16384)
    bench.pass_ms(1_000)
    assert bench.see("angle_deg") == pytest.approx(45.0014, abs=2 * ENCODER_DEG)
    assert bench.read(0x6401, 1) == pytest.approx(16384, abs=1)


def test_a_measured_value_beyond_full_scale_stays_there(bench: UnitBench) -> None:
    bench.begin(VELOCITY, 32767)
    bench.pass_ms(1_000)
    assert bench.see("angle_deg") > 300
    assert bench.read(0x6401, 1) == 32767
    bench.write(0x2010, 0, sub=1)
    bench.pass_ms(20)
    assert bench.read(0x6401, 1) == 32767


def test_a_velocity_is_ramped_and_kept(bench: UnitBench) -> None:
    bench.begin(VELOCITY, 16384)
    bench.pass_ms(30)
    assert bench.status == ON
    assert 0 < bench.see("velocity_deg_s") < 180
    bench.pass_ms(500)
    assert bench.status == ON | REACHED
    assert bench.see("velocity_deg_s") == pytest.approx(180, rel=0.01)
    assert bench.read(0x6401, 2) == pytest.approx(16384, rel=0.01)


def test_a_current_makes_the_torque_of_the_table(bench: UnitBench) -> None:
    """9.0 Nm/A, 0.05 kg m^2, 0.5 Nm of friction (K19)."""
    bench.begin(CURRENT, 3277)
    bench.pass_ms(18)
    assert bench.see("current_a") == pytest.approx(1.0, rel=0.02)
    before = bench.see("velocity_deg_s")
    bench.pass_ms(10)
    assert bench.read(0x6401, 3) == pytest.approx(3277, rel=0.02)
    acceleration_rad_s2 = radians(bench.see("velocity_deg_s") - before) / 0.01
    assert acceleration_rad_s2 == pytest.approx((9.0 - 0.5) / 0.05, rel=0.01)


def test_a_current_limit_holds(bench: UnitBench) -> None:
    bench.begin(VELOCITY)
    bench.refer(32767, current_limit=983)
    seen, status = [], 0
    for _ in range(100):
        bench.pass_ms(2)
        seen.append(bench.see("current_a"))
        status |= bench.status
    assert max(seen) == pytest.approx(0.3, abs=0.015)
    assert status & LIMITED


@pytest.mark.unmeasured
@pytest.mark.parametrize("supply_v", [10, 24, 48])
@pytest.mark.parametrize("direction", [-1, 1])
def test_a_supply_below_60_v_limits_the_velocity_and_bit_2_says_so(
    bench: UnitBench, supply_v: int, direction: int
) -> None:
    bench.set("supply_v", supply_v)
    bench.begin(VELOCITY, 32767 * direction)
    bench.pass_ms(1_000)
    assert bench.see("velocity_deg_s") == pytest.approx(6 * supply_v * direction, rel=0.01)
    assert bench.status == ON | LIMITED
    bench.refer(round(32767 * direction * supply_v / 60 * 0.98))
    bench.pass_ms(1_000)
    assert bench.status == ON | REACHED
    assert bench.emergencies == []


@pytest.mark.unmeasured
@pytest.mark.parametrize(("supply_v", "after_ms"), [(10, 1_635), (24, 808), (48, 535), (60, 354)])
def test_a_supply_below_60_v_delays_an_angle_and_does_no_more(
    bench: UnitBench, supply_v: int, after_ms: int
) -> None:
    bench.set("supply_v", supply_v)
    bench.begin(ANGLE, 16384)
    seen = []
    for _ in range(after_ms + 300):
        bench.pass_ms(1)
        seen.append((bench.see("angle_deg"), bench.status))
    there = next(ms for ms, (deg, _) in enumerate(seen, 3) if abs(deg - 90.0027) < 0.01)
    assert there == pytest.approx(after_ms, abs=5)
    assert max(deg for deg, _ in seen) < 90.0027 + ENCODER_DEG
    assert any(status & LIMITED for _, status in seen) == (supply_v < 60)
    assert min(deg for deg, status in seen if status & REACHED) > 89.0
    assert (bench.status, bench.emergencies) == (ON | REACHED, [])


@pytest.mark.unmeasured
def test_with_a_velocity_limit_that_the_supply_allows_the_shaft_follows_its_plan(
    bench: UnitBench,
) -> None:
    bench.set("supply_v", 24)
    bench.begin(ANGLE)
    bench.refer(16384, velocity_limit=round(32767 * 24 / 60 * 0.98))
    for _ in range(70):
        bench.pass_ms(10)
        assert not bench.status & LIMITED
    assert (bench.status, round(bench.see("angle_deg"), 2)) == (ON | REACHED, 90.0)


@pytest.mark.parametrize("mode", [CURRENT, VELOCITY])
def test_a_load_that_drives_a_motor_at_its_highest_speed_is_no_open_wire(
    bench: UnitBench, mode: int
) -> None:
    bench.set("supply_v", 24)
    bench.set("shaft_load_nm", 0.52)  # as much as friction takes
    bench.begin(mode, 32767 if mode == VELOCITY else 3277)
    bench.pass_ms(2_000)
    assert abs(bench.see("current_a")) < 0.01
    assert bench.emergencies == []


def test_free_lets_the_shaft_coast_to_a_stop(bench: UnitBench) -> None:
    bench.begin(VELOCITY, 32767)
    bench.pass_ms(500)
    bench.write(0x2000, FREE)
    bench.pass_ms(20)
    assert (bench.status, bench.see("current_a")) == (0, 0)
    assert bench.see("velocity_deg_s") > 300
    bench.pass_ms(2_000)
    assert bench.see("velocity_deg_s") == 0


@pytest.mark.unmeasured
@pytest.mark.parametrize("command", [STOP, PRE_OPERATIONAL])
@pytest.mark.parametrize("mode", [CURRENT, VELOCITY, ANGLE])
def test_whoever_leaves_operational_brakes_and_holds(
    bench: UnitBench, mode: int, command: str
) -> None:
    bench.begin(mode, 4_000 if mode == CURRENT else 10_000)
    bench.pass_ms(100)
    before_deg = bench.see("angle_deg")
    assert bench.see("velocity_deg_s") > 100
    bench.send(command)
    bench.pass_ms(500)
    assert abs(bench.see("velocity_deg_s")) < 0.1
    assert bench.see("angle_deg") - before_deg < 360**2 / 3_600
    assert bench.status == ON
    bench.refer(-10_000)
    bench.pass_ms(100)
    assert abs(bench.see("velocity_deg_s")) < 0.1


def test_a_reference_acts_again_when_the_node_is_operational_again(bench: UnitBench) -> None:
    bench.begin(VELOCITY, 16384)
    bench.pass_ms(100)
    bench.send(PRE_OPERATIONAL)
    bench.pass_ms(500)
    bench.send(START)
    bench.pass_ms(500)
    assert bench.see("velocity_deg_s") == pytest.approx(180, rel=0.01)


@pytest.mark.unmeasured
@pytest.mark.parametrize("first", [CURRENT, VELOCITY, ANGLE])
@pytest.mark.parametrize("second", [VELOCITY, ANGLE])
def test_a_mode_begins_with_the_motion_that_is(bench: UnitBench, first: int, second: int) -> None:
    bench.begin(first, 4_000 if first == CURRENT else 12_000)
    bench.pass_ms(120)
    bench.write(0x2000, second)
    fastest = 0.0
    before = bench.see("velocity_deg_s")
    for _ in range(40):
        bench.pass_ms(1)
        now = bench.see("velocity_deg_s")
        fastest, before = max(fastest, abs(now - before)), now
    assert before != 0
    assert fastest < 6  # 3.6 per ms by plan


def test_the_current_has_no_step_within_a_control_tick(bench: UnitBench) -> None:
    bench.begin(CURRENT, 10_000)
    seen = []
    for _ in range(12):
        bench.pass_ms(1)
        seen.append(bench.see("current_a"))
    steps = [after - before for before, after in pairwise(seen)]
    assert max(steps) < 0.6


@pytest.mark.parametrize("mode", [4, 255])
def test_a_mode_that_is_none_is_refused(bench: UnitBench, mode: int) -> None:
    with pytest.raises(SdoAbort, match="VALUE_TOO_HIGH"):
        bench.write(0x2000, mode)


def test_a_mode_that_is_none_is_free_where_nobody_could_refuse_it(bench: UnitBench) -> None:
    bench.begin(ANGLE, 8192)
    bench.slave.dictionary[0x2000, 0].value = 9
    bench.pass_ms(20)
    assert (bench.unit.read("mode"), bench.status) == ("free", 0)


def test_a_reset_of_the_node_lets_go_of_the_motor(bench: UnitBench) -> None:
    bench.begin(ANGLE, 8192)
    bench.pass_ms(500)
    bench.send(RESET)
    bench.pass_ms(20)
    assert (bench.read(0x2000), bench.status, bench.see("current_a")) == (0, 0, 0)


def test_the_gear_encoder_knows_the_angle_after_a_power_cut(bench: UnitBench) -> None:
    bench.begin(ANGLE, -24568)
    bench.pass_ms(1_000)
    bench.slave.reset()
    bench.send()
    bench.begin(ANGLE, -24568)
    assert bench.read(0x6401, 1) == pytest.approx(-24568, abs=2)
    bench.pass_ms(500)
    assert bench.see("angle_deg") == pytest.approx(-134.9602, abs=0.006)


def test_a_shaft_coasts_while_the_power_is_cut(bench: UnitBench) -> None:
    bench.begin(VELOCITY, 32767)
    bench.pass_ms(500)
    bench.slave.reset()
    bench.now_us += 5_000_000
    bench.send()
    assert bench.see("velocity_deg_s") == 0


def test_a_shaft_without_power_is_moved_by_the_world_alone(bench: UnitBench) -> None:
    bench.begin(VELOCITY, 8_192)
    bench.pass_ms(500)
    at_us = bench.now_us
    while (due_us := bench.unit.without_power(at_us)) != NEVER:
        assert due_us == at_us + 1_000
        at_us = due_us
    assert bench.see("velocity_deg_s") == 0
    rested_deg = bench.see("angle_deg")
    bench.set("shaft_load_nm", -5)
    assert bench.unit.without_power(at_us + 1_000) == at_us + 2_000
    bench.unit.without_power(at_us + 100_000)
    assert bench.see("angle_deg") < rested_deg


def test_a_unit_at_rest_waits_for_nothing_but_its_temperature(bench: UnitBench) -> None:
    bench.begin(ANGLE, 8192)
    bench.pass_ms(2_000)
    assert bench.slave.due_us > bench.now_us + 10_000
    bench.pass_ms(7_200_000)
    assert bench.slave.due_us == NEVER
    assert bench.see("winding_c") == pytest.approx(25, abs=0.2)


def test_what_an_observer_sees_has_names(bench: UnitBench) -> None:
    bench.begin(VELOCITY, 100)
    bench.pass_ms(10)
    assert set(bench.unit.outputs) == {
        *("angle_deg", "velocity_deg_s", "current_a", "winding_c"),
        *("target_deg", "mode", "status"),
    }
    assert {name: bench.unit.read(name) for name in ("mode", "status")} == {
        "mode": "velocity",
        "status": "on",
    }
    with pytest.raises(KeyError, match="colour"):
        bench.unit.read("colour")


def test_the_supply_is_measured(bench: UnitBench) -> None:
    bench.set("supply_v", 24.5)
    bench.pass_ms(20)
    assert bench.read(0x6401, 4) == 2_450
    assert not bench.status & FAULT
