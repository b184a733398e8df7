from __future__ import annotations

from math import hypot, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.device.body import OmniBody, OmniParameters, Velocity

speeds = st.floats(-0.3, 0.3)


def went(velocity: Velocity, duration_ms: int = 2_000) -> OmniBody:
    body = OmniBody()
    for _ in range(duration_ms):
        body.step(velocity)
    return body


@given(speeds, speeds, speeds)
def test_wheels_make_the_velocity_that_was_wanted(vx: float, vy: float, w: float) -> None:
    omni = OmniParameters()
    assert omni.velocity(omni.wheel_speeds(Velocity(vx, vy, w))) == pytest.approx((vx, vy, w))


def test_straight_ahead_the_rear_wheel_stands() -> None:
    left, rear, right = OmniParameters().wheel_speeds(Velocity(vx=0.1))
    assert rear == pytest.approx(0)
    assert left == pytest.approx(-right)
    assert right > 0


@pytest.mark.parametrize("velocity", [Velocity(0.2), Velocity(0, -0.2), Velocity(0.1, 0.1)])
def test_it_goes_any_way_without_turning(velocity: Velocity) -> None:
    pose = went(velocity).pose
    late_s = 2.0 - 0.05
    assert pose.x_m == pytest.approx(velocity.vx * late_s, abs=1e-3)
    assert pose.y_m == pytest.approx(velocity.vy * late_s, abs=1e-3)
    assert pose.heading_rad == pytest.approx(0)


@pytest.mark.unmeasured
def test_it_goes_round_a_circle_with_its_side_to_the_middle() -> None:
    body = went(Velocity(vx=0.2, w=0.2 * pi), 10_050)
    assert body.pose.heading_rad == pytest.approx(2 * pi, abs=1e-3)
    assert hypot(body.pose.x_m, body.pose.y_m) < 0.01


def test_speeds_follow_with_the_time_constant() -> None:
    assert went(Velocity(vx=0.2), 50).velocity.vx == pytest.approx(0.2 * 0.63, rel=0.02)


def test_where_a_wheel_would_be_too_fast_all_are_slower() -> None:
    omni = OmniParameters(most_rad_s=1.0)
    slow = omni.wheel_speeds(Velocity(3.0, 1.0, 2.0))
    assert max(map(abs, slow)) == pytest.approx(1.0)
    vx, vy, w = omni.velocity(slow)
    assert (vy / vx, w / vx) == pytest.approx((1 / 3, 2 / 3))


@pytest.mark.parametrize("name", ["wheel_radius_m", "base_radius_m", "response_s", "most_rad_s"])
def test_a_number_that_is_not_above_0_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=f"{name} 0.0 is not above 0"):
        OmniParameters(**{name: 0.0})
