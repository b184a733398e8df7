"""A servo as its drive and an observer see it."""

from __future__ import annotations

import pytest

from tickrig.device.servo.presets import PRESETS
from tickrig.device.servo.servo import Servo

SECOND_US = 1_000_000


@pytest.fixture(params=PRESETS)
def servo(request: pytest.FixtureRequest) -> Servo:
    return Servo(PRESETS[request.param])


def test_a_position_is_reached_to_the_count_and_held_at_rest(servo: Servo) -> None:
    servo.drive_position(12_345)
    servo.step_to(3 * SECOND_US)
    assert (servo.counts, servo.resting) == (12_345, True)
