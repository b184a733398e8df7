"""An attribute whose change has consequences."""

from __future__ import annotations

from tickrig.device.servo.setting import Setting


class Lamp:
    """Counts how often it was changed."""

    level = Setting(1.0)

    def __init__(self) -> None:
        self.changes = 0

    def changed(self) -> None:
        self.changes += 1


def test_only_another_value_is_a_change() -> None:
    lamp = Lamp()
    for level in (1.0, 2.0, 2.0, 1.0):
        lamp.level = level
        assert lamp.level == level
    assert lamp.changes == 2


def test_a_class_shows_its_setting() -> None:
    assert isinstance(Lamp.level, Setting)
