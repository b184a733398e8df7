from __future__ import annotations

import pytest

from tickrig.device.servo.parameters import (
    PRESETS,
    ServoParameters,
    free_speed_rad_s,
    of_size,
    peak_torque_nm,
)
from tickrig.device.servo.servo import Servo

SIZES = (0.03, 0.5, 3.0, 40.0)


@pytest.mark.parametrize("servo", PRESETS.values(), ids=PRESETS)
@pytest.mark.parametrize("size", SIZES)
def test_torque_grows_with_the_size_and_speed_stays(servo: ServoParameters, size: float) -> None:
    other = of_size(servo, size)
    assert peak_torque_nm(other) == pytest.approx(size * peak_torque_nm(servo))
    assert free_speed_rad_s(other) == pytest.approx(free_speed_rad_s(servo))


@pytest.mark.parametrize("size", SIZES)
def test_several_side_by_side_move_as_one_does(size: float) -> None:
    def position(servo: ServoParameters) -> list[int]:
        machine, found = Servo(servo), []
        for tick in range(300):
            machine.step_to(1_000 * tick)
            machine.drive_position(min(tick, 200) * 40)
            found.append(machine.counts)
        return found

    one = PRESETS["epos-wheel"]
    differences = [
        abs(a - b) for a, b in zip(position(one), position(of_size(one, size)), strict=True)
    ]
    assert max(differences) <= 1
