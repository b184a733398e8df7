"""UMBmark squares on the emulated base (rh3-control, targets)."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tickrig.device.rh3.parameters import BaseParameters
from tickrig.emulators.rh3.closed_loop import ClosedLoop
from tickrig.host.rtc.motion.drive import drive, start
from tickrig.host.rtc.motion.geometry import Pose, Wheels
from tickrig.host.rtc.motion.umbmark import run_umbmark, square

SIDE_M = 2.0
"""Half of UMBmark's, for half the time."""

NOMINAL = Wheels(0.0995, 0.0995, 0.464)
WRONG = BaseParameters(
    tread_m=0.464 * 1.01, radius_left_m=0.0995 * 1.002, radius_right_m=0.0995 * 0.998
)


def begin(parameters: BaseParameters, wheels: Wheels = NOMINAL) -> Callable[[int], ClosedLoop]:
    def start_cart(number: int) -> ClosedLoop:
        loop = ClosedLoop(parameters)
        loop.chain.odometry.calibrate(wheels)
        start(loop, "tuned")
        return loop

    return start_cart


@pytest.mark.parametrize(("set_id", "most_m"), [("default", 0.040), ("tuned", 0.005)])
def test_a_calibrated_cart_returns_to_its_start(set_id: str, most_m: float) -> None:
    """23.0 and 0.9 mm."""
    loop = ClosedLoop()
    start(loop, set_id)
    assert drive(loop, square(clockwise=False)).end.distance(Pose()) <= most_m


def test_a_calibration_makes_errors_of_wheels_and_tread_ten_times_smaller() -> None:
    """1 % of the tread, 0.2 % of each wheel; on squares of 4 m 575 mm become 43 mm."""
    before = run_umbmark(begin(WRONG), runs=1, side_m=SIDE_M)
    corrected = before.corrected(NOMINAL, SIDE_M)
    after = run_umbmark(begin(WRONG, corrected), runs=1, side_m=SIDE_M)
    assert after.most_m <= before.most_m / 10
    assert max(after.returns_m) <= max(before.returns_m) / 10
