from __future__ import annotations

import pytest

from tickrig.device.canopen.ds402.axis import IdealMotor


def test_it_is_where_it_shall_be_at_once() -> None:
    motor = IdealMotor()
    motor.drive_position(500.4, 20.0)
    motor.step_to(1_000_000)
    assert (motor.counts, motor.velocity_counts_s) == (500, 20)
    assert motor.shaft_deg == pytest.approx(500.4 * 360 / 2_000)
    assert motor.shaft_deg_s == pytest.approx(20 * 360 / 2_000)


def test_it_turns_on_with_its_velocity_until_it_is_released() -> None:
    motor = IdealMotor()
    motor.drive_velocity(1_000.0)
    motor.step_to(500_000)
    assert (motor.counts, motor.resting) == (500, False)
    motor.release()
    motor.step_to(1_000_000)
    assert (motor.counts, motor.velocity_counts_s, motor.resting) == (500, 0, True)


def test_a_current_accelerates_it() -> None:
    motor = IdealMotor()
    motor.drive_current(2.0)
    assert motor.current_ma == 2_000
    motor.step_to(1_000_000)
    assert (motor.velocity_counts_s, motor.counts) == (2_000, 1_000)
