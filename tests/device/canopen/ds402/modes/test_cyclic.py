"""Modes with a target in each SYNC cycle, and torque modes, against closed forms."""

from __future__ import annotations

from itertools import pairwise
from math import cos, pi

import pytest

from tests.device.canopen.ds402.wheel import BIT_12, INTERNAL_LIMIT, RPM, TURN, Wheel
from tickrig.device.servo.parameters import EPOS_WHEEL

MOTOR, GEAR = EPOS_WHEEL.motor, EPOS_WHEEL.gear
INERTIA = MOTOR.inertia_kg_m2 + GEAR.inertia_kg_m2 / GEAR.ratio**2
DRY_NM = MOTOR.coulomb_nm + GEAR.coulomb_nm / GEAR.ratio
CYCLE_MS = 10


@pytest.fixture
def wheel() -> Wheel:
    return Wheel()


def swing(wheel: Wheel, amplitude: int, period_ms: int, cycles: int) -> list[tuple[float, int]]:
    """Have it follow 1 - cos with SYNC; return demand and position at each millisecond."""
    seen = []
    for cycle in range(cycles):
        phase = 2 * pi * (cycle + 1) * CYCLE_MS / period_ms
        wheel.write(0x607A, round(amplitude * (1 - cos(phase))))
        wheel.step("080#")
        for _ in range(CYCLE_MS):
            seen.append((wheel.drive.axis.reference.position, wheel.read(0x6064)))
            if len(seen) % CYCLE_MS:
                wheel.step()
    return seen


@pytest.mark.unmeasured
def test_csp_follows_a_cosine_of_targets(wheel: Wheel) -> None:
    amplitude, period_ms = 4_000, 1_000
    wheel.step("000#0101")
    wheel.enable(8)
    seen = swing(wheel, amplitude, period_ms, 200)
    for passed_ms, (demand, position) in enumerate(seen, 1):
        wanted = amplitude * (1 - cos(2 * pi * passed_ms / period_ms))
        assert demand == pytest.approx(wanted, abs=3)  # chords of 10 ms are 2 counts away
        assert position == pytest.approx(demand, abs=60)  # a step of control at 25 000 counts/s


@pytest.mark.unmeasured
def test_csp_has_a_reference_without_steps(wheel: Wheel) -> None:
    wheel.step("000#0101")
    wheel.enable(8)
    demands = [demand for demand, _ in swing(wheel, 4_000, 1_000, 100)]
    fastest = 4_000 * 2 * pi / 1_000
    assert max(abs(b - a) for a, b in pairwise(demands)) < fastest * 1.01


def test_csp_is_where_the_target_was_told_after_a_period(wheel: Wheel) -> None:
    wheel.enable(8)
    wheel.write(0x607A, 200)
    wheel.run(5)
    assert wheel.drive.axis.reference.position == pytest.approx(100)
    wheel.run(5)
    assert wheel.drive.axis.reference.position == pytest.approx(200)
    wheel.run(100)
    assert wheel.read(0x6064) == pytest.approx(200, abs=2)
    assert wheel.read(0x6041) & BIT_12


def test_csp_adds_its_offset_and_keeps_to_limits(wheel: Wheel) -> None:
    wheel.write(0x607D, -1_000, sub=1)
    wheel.write(0x607D, 150, sub=2)
    wheel.write(0x607F, 500)
    wheel.enable(8)
    wheel.write(0x60B0, 100)
    wheel.write(0x607A, 100)
    wheel.step()
    assert wheel.read(0x606B) == 450
    wheel.run(50)
    assert wheel.drive.axis.reference.position == pytest.approx(150)
    wheel.write(0x607A, -900)
    wheel.step()
    assert wheel.read(0x6041) & INTERNAL_LIMIT
    assert wheel.read(0x606B) == -500


def test_a_target_beyond_the_wrap_is_reached_on_the_shorter_way(wheel: Wheel) -> None:
    axis = wheel.drive.axis
    axis.zero = -(2**31 - 50.0)
    wheel.enable(8)
    assert wheel.read(0x6064) == 2**31 - 50
    wheel.write(0x607A, -(2**31) + 50)
    wheel.run(100)
    assert axis.reference.position == pytest.approx(100)
    assert wheel.read(0x6064) == pytest.approx(-(2**31) + 50, abs=2)


def test_csv_ramps_within_the_period_and_adds_its_offset(wheel: Wheel) -> None:
    wheel.enable(9)
    wheel.write(0x60FF, 300)
    wheel.write(0x60B1, 100)
    wheel.run(5)
    assert wheel.read(0x606B) == 200
    wheel.run(5)
    assert wheel.read(0x606B) == 400
    wheel.run(300)
    assert wheel.read(0x606C) == pytest.approx(400, abs=2)


def test_csv_keeps_to_the_largest_acceleration(wheel: Wheel) -> None:
    wheel.write(0x60C5, 5_000)
    wheel.write(0x60C6, 10_000)
    wheel.enable(9)
    wheel.write(0x60FF, 500)
    assert wheel.run_until(lambda: wheel.read(0x606B) == 500) == 100
    wheel.write(0x60FF, 0)
    assert wheel.run_until(lambda: wheel.read(0x606B) == 0) == 50


@pytest.mark.parametrize("mode", [10, -3])
def test_torque_accelerates_the_wheel_as_newton_says(wheel: Wheel, mode: int) -> None:
    current_a = 1.032
    wheel.enable(mode)
    wheel.write(*(0x6071, 300) if mode == 10 else (0x2030, 1_032))
    wheel.run(1 + 50)
    torque = MOTOR.torque_constant_nm_a * current_a - DRY_NM
    wanted = torque / INERTIA * 0.050 / (2 * pi) * 60  # viscous friction is 1 % of the rest
    assert wheel.read(0x606C) == pytest.approx(wanted, rel=0.03)
    assert wheel.read(0x6078) == pytest.approx(1_032, abs=5)


@pytest.mark.unmeasured
def test_torque_ends_at_the_speed_that_the_voltage_allows(wheel: Wheel) -> None:
    wheel.enable(10)
    wheel.write(0x6071, 1_000)
    wheel.run(3_000)
    free_a = wheel.read(0x6078) / 1_000
    volts = 0.9 * 24 - MOTOR.resistance_ohm * free_a
    assert wheel.read(0x606C) == pytest.approx(
        volts / MOTOR.torque_constant_nm_a / (2 * pi) * 60, rel=0.01
    )
    assert wheel.read(0x6077) < 150


def test_profile_torque_ramps_with_its_slope_and_tells(wheel: Wheel) -> None:
    wheel.set(shaft_blocked=1)
    wheel.write(0x6087, 5_000)
    wheel.enable(4)
    wheel.write(0x6071, 500)
    wheel.run(50)
    assert wheel.read(0x6074) == 250
    assert wheel.run_until(lambda: bool(wheel.read(0x6041) & 0x0400)) == 50
    wheel.run(5)
    assert wheel.read(0x6077) == pytest.approx(500, abs=2)
    wheel.write(0x6040, 0x10F)
    wheel.run(101)
    assert wheel.read(0x6074) == 0


@pytest.mark.parametrize(
    ("index", "value", "forward", "backward"),
    [
        *((0x6072, 400, 400, -400), (0x6073, 300, 300, -300)),
        *((0x60E0, 200, 200, -1_000), (0x60E1, 100, 1_000, -100)),
    ],
)
def test_torque_is_cut_by_each_limit(
    wheel: Wheel, index: int, value: int, forward: int, backward: int
) -> None:
    wheel.set(shaft_blocked=1)
    wheel.write(index, value)
    wheel.enable(10)
    for wanted, got in ((1_000, forward), (-1_000, backward)):
        wheel.write(0x6071, wanted)
        wheel.run(3)
        assert wheel.read(0x6074) == got
        assert bool(wheel.read(0x6041) & INTERNAL_LIMIT) is (wanted != got)


@pytest.mark.unmeasured
def test_profile_velocity_is_a_trapezoid(wheel: Wheel) -> None:
    wheel.write(0x6083, 2_000)
    wheel.write(0x6084, 4_000)
    wheel.write(0x60FF, 1_000)
    wheel.enable(3)
    for passed_ms in range(1, 1_000):
        assert wheel.read(0x606B) == min(1_000, 2 * passed_ms)
        assert wheel.read(0x606C) == pytest.approx(wheel.read(0x606B), abs=20)
        wheel.step()
    way = wheel.read(0x6064)
    assert way == pytest.approx((0.5 / 2 + 0.5) * 1_000 * RPM, rel=0.01)
    wheel.write(0x60FF, 0)
    wheel.run(249)
    assert wheel.read(0x606B) == 4
    wheel.run(50)
    assert wheel.read(0x6041) & (0x0400 | BIT_12) == 0x0400 | BIT_12


def test_profile_velocity_waits_for_its_windows(wheel: Wheel) -> None:
    wheel.write(0x606D, 5)
    wheel.write(0x606E, 50)
    wheel.write(0x606F, 5)
    wheel.write(0x6070, 30)
    wheel.write(0x60FF, 500)
    wheel.enable(3)
    assert wheel.run_until(lambda: wheel.read(0x6041) & BIT_12 == 0) <= 1
    wheel.run_until(lambda: abs(wheel.read(0x606C) - 500) <= 5)
    assert wheel.run_until(lambda: bool(wheel.read(0x6041) & 0x0400)) in range(45, 75)
    wheel.write(0x60FF, 0)
    wheel.run_until(lambda: abs(wheel.read(0x606C)) <= 5)
    assert wheel.run_until(lambda: bool(wheel.read(0x6041) & BIT_12)) in range(20, 45)


def test_maxons_velocity_and_position_are_followed_at_once(wheel: Wheel) -> None:
    wheel.enable(-2)
    wheel.write(0x206B, 300)
    wheel.step()
    assert wheel.read(0x606B) == 300
    wheel.write(0x6060, -1)
    wheel.run(100)
    assert wheel.read(0x6061) == -1
    wheel.write(0x2062, wheel.read(0x6062) + 100)
    wheel.step()
    assert wheel.drive.axis.following_error == pytest.approx(100, abs=5)
    wheel.run(100)
    assert wheel.read(0x60F4) == pytest.approx(0, abs=2)


def test_a_polarity_turns_position_and_velocity(wheel: Wheel) -> None:
    wheel.write(0x607E, 0xC0)
    wheel.write(0x60FF, 600)
    wheel.enable(3)
    wheel.run(500)
    assert wheel.read(0x606C) == pytest.approx(600, abs=3)
    assert wheel.read(0x6064) > 5_000
    assert wheel.drive.read("shaft_deg") == pytest.approx(
        -wheel.read(0x6064) / TURN / 51 * 360, abs=0.5
    )


def test_outputs_show_what_an_observer_sees(wheel: Wheel) -> None:
    wheel.write(0x60FF, 600)
    wheel.enable(3)
    wheel.run(500)
    shown = {name: wheel.drive.read(name) for name in wheel.drive.outputs}
    assert shown["shaft_deg_s"] == pytest.approx(600 * 6 / 51, rel=0.01)
    assert (shown["position"], shown["mode"]) == (wheel.read(0x6064), 3)
    assert shown["drive_state"] == "Operation enabled"
    assert shown["current_a"] == wheel.read(0x6078) / 1_000


def test_a_line_is_ahead_as_it_is_then_run(wheel: Wheel) -> None:
    wheel.step("000#0101")
    wheel.enable(8)
    wheel.write(0x607A, 200)
    wheel.step("080#")
    ahead, run = wheel.drive.mode.ahead(), []
    for _ in range(20):
        wheel.step()
        run.append((wheel.drive.axis.reference.position, wheel.drive.axis.reference.velocity))
    assert ahead is not None
    assert (ahead.goal, ahead.left, ahead.added) == (200.0, 9, 0.0)
    assert (ahead.position, ahead.velocity) == pytest.approx((20, 20_000))
    assert run[ahead.left] == (run[ahead.left - 1][0], 0.0)
    assert run[-1] == pytest.approx((200, 0))


def test_a_line_is_ahead_with_the_limit_that_cuts_it(wheel: Wheel) -> None:
    wheel.step("000#0101")
    wheel.enable(8)
    wheel.write(0x607A, 10_000_000)
    wheel.step("080#")
    ahead = wheel.drive.mode.ahead()
    assert ahead is not None
    assert (ahead.goal - ahead.position) / (ahead.left / 1_000) > ahead.most == 25_000 * RPM


def test_a_line_that_goes_nowhere_lets_the_drive_rest(wheel: Wheel) -> None:
    wheel.step("000#0101")
    wheel.write(0x60C2, 200, 1)
    wheel.enable(8)
    wheel.write(0x607A, 200)
    for _ in range(2):
        wheel.step("080#")
        wheel.run(250)
    wheel.step("080#")
    wheel.run(20)
    assert wheel.read(0x6064) == pytest.approx(200, abs=1)
    assert wheel.drive.axis.motor.resting
    assert wheel.drive.asked_us > wheel.now_us + 100_000


@pytest.mark.parametrize("mode", [1, 7])
def test_other_modes_are_known_step_by_step_alone(wheel: Wheel, mode: int) -> None:
    wheel.enable(mode)
    assert wheel.drive.mode.ahead() is None
