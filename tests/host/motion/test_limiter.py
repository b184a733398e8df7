from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.motion.control_laws import VelocityLimits, steps
from tickrig.host.motion.geometry import Twist

LIMITS = VelocityLimits(v=1.0, w=0.3, dv=0.006, dw=0.1)
speeds = st.floats(-1e3, 1e3)


@given(st.lists(st.builds(Twist, speeds, speeds), max_size=50))
def test_no_command_violates_a_limit(wanted: list[Twist]) -> None:
    before = Twist()
    for twist in wanted:
        now = LIMITS.smooth(twist, before)
        assert abs(now.v) <= LIMITS.v
        assert abs(now.w) <= LIMITS.w
        assert abs(now.v - before.v) <= LIMITS.dv + 1e-12
        assert abs(now.w - before.w) <= LIMITS.dw + 1e-12
        before = now


def test_what_is_within_the_limits_passes() -> None:
    assert LIMITS.smooth(Twist(0.105, 0.05), Twist(0.1, 0.0)) == Twist(0.105, 0.05)


@pytest.mark.parametrize(
    ("tick_s", "acc_cycle_s", "dv", "dw"),
    [
        (0.02, 0.001, 0.006, 0.1),  # 0.3 m/s2, and the cap of 5 rad/s2
        (0.001, 0.001, 0.0003, 0.005),
        (0.02, 0.02, 0.0003, 0.1),  # the literal reading
    ],
)
def test_steps_are_given_for_each_acc_cycle(
    tick_s: float, acc_cycle_s: float, dv: float, dw: float
) -> None:
    assert steps(0.0003, 0.1, tick_s, acc_cycle_s) == pytest.approx((dv, dw))
