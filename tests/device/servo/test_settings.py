"""Attributes whose change has consequences."""

from __future__ import annotations

from tickrig.device.servo.readings import ServoSettings


class Motor(ServoSettings):
    """Counts how often it was changed."""

    def __init__(self) -> None:
        super().__init__(24.0)
        self.changes = 0

    def changed(self) -> None:
        self.changes += 1


def test_only_another_value_is_a_change() -> None:
    motor = Motor()
    for current_a in (1.0, 2.0, 2.0, 1.0):
        motor.current_limit_a = current_a
        assert motor.current_limit_a == current_a
    assert motor.changes == 3


def test_each_has_a_value_to_begin_with() -> None:
    motor = Motor()
    assert (motor.supply_v, motor.ambient_c, motor.load_nm) == (24.0, 25.0, 0.0)
    assert [motor.blocked, motor.phase_open, motor.encoder_unplugged] == [False] * 3
