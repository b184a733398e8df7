"""Bodies against closed forms."""

from __future__ import annotations

from math import pi, tau

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.device.body import GRAVITY_M_S2, STEP_S, BodyParameters, Contact, Pose, WheeledBody

RADIUS, TREAD = 0.05, 0.4
ways = st.floats(-10, 10)


def differential(mass_kg: float = 0, friction: float | None = None) -> WheeledBody:
    return WheeledBody(
        BodyParameters(
            kind="differential",
            wheel_radius_m=RADIUS,
            tread_m=TREAD,
            mass_kg=mass_kg,
            friction=friction,
        )
    )


class Driver:
    """Turns the wheels of a differential drive."""

    def __init__(self, body: WheeledBody) -> None:
        self.body, self.left, self.right = body, 0.0, 0.0

    def roll(self, left_m: float, right_m: float, steps: int = 500) -> None:
        for _ in range(steps):
            self.left += left_m / RADIUS / steps
            self.right += right_m / RADIUS / steps
            self.body.step({"left": self.left, "right": self.right})


def assert_at(pose: Pose, x_m: float, y_m: float, heading_rad: float) -> None:
    assert (pose.x_m, pose.y_m, pose.heading_rad) == pytest.approx(
        (x_m, y_m, heading_rad), abs=1e-9
    )


def test_equal_ways_go_straight_on() -> None:
    body = differential()
    body.pose = Pose(1, 2, pi / 6)
    Driver(body).roll(2, 2)
    assert_at(body.pose, 1 + 2 * 0.75**0.5, 3, pi / 6)


def test_opposite_ways_turn_on_the_spot() -> None:
    body = differential()
    Driver(body).roll(-TREAD * 0.75 * pi, TREAD * 0.75 * pi)
    assert_at(body.pose, 0, 0, 1.5 * pi)
    assert body.pose.wrapped_rad == pytest.approx(-pi / 2)


def test_different_ways_go_along_an_arc() -> None:
    body, radius_m, turn_rad = differential(), 1.5, pi / 2
    Driver(body).roll((radius_m - TREAD / 2) * turn_rad, (radius_m + TREAD / 2) * turn_rad)
    assert_at(body.pose, radius_m, radius_m, turn_rad)


@given(ways, ways, st.integers(1, 20))
def test_an_arc_is_the_same_in_one_step_or_in_many(left: float, right: float, steps: int) -> None:
    whole, parts = Pose(1, 2, 3).moved(left, right, TREAD), Pose(1, 2, 3)
    for _ in range(steps):
        parts = parts.moved(left / steps, right / steps, TREAD)
    assert_at(parts, whole.x_m, whole.y_m, whole.heading_rad)


@given(ways, ways)
def test_an_arc_back_ends_where_it_began(left: float, right: float) -> None:
    pose = Pose(1, 2, 3)
    back = pose.moved(left, right, TREAD).moved(-left, -right, TREAD)
    assert_at(back, 1, 2, 3)


@pytest.mark.parametrize("turn", [1, -1])
def test_a_square_ends_where_it_began(turn: int) -> None:
    """UMBmark (J. Borenstein, L. Feng, 1996): four sides of 4 m, both ways round."""
    body = differential()
    driver = Driver(body)
    for _ in range(4):
        driver.roll(4, 4)
        driver.roll(-turn * TREAD * pi / 4, turn * TREAD * pi / 4)
    assert_at(body.pose, 0, 0, turn * tau)
    assert body.pose.wrapped_rad == pytest.approx(0, abs=1e-9)


def test_a_skid_steer_goes_as_the_mean_of_each_side() -> None:
    body = WheeledBody(BodyParameters(kind="skid-steer", wheel_radius_m=0.1, tread_m=0.4))
    body.step({"front_left": 1, "rear_left": 3, "front_right": 5, "rear_right": 3})
    one = Pose().moved(0.2, 0.4, 0.4)
    assert_at(body.pose, one.x_m, one.y_m, one.heading_rad)


def test_its_speeds_are_those_of_the_latest_step() -> None:
    body = differential()
    Driver(body).roll(0.4, 0.6, steps=100)
    assert (body.speed_m_s, body.turn_rad_s) == pytest.approx((5, 5))


def test_it_rests_when_its_wheels_have_stood_still_for_a_step() -> None:
    body = differential()
    rested = [body.resting]
    for angle in (0.01, 0.01):
        body.step({"left": angle, "right": angle})
        rested.append(body.resting)
    assert rested == [True, False, True]
    assert (body.speed_m_s, body.turn_rad_s) == (0, 0)


def test_each_wheel_feels_its_share_of_the_mass() -> None:
    body = differential(mass_kg=10)
    for contact in body.contacts.values():
        assert contact.load_kg_m2 == pytest.approx(5 * RADIUS**2)
        assert contact.load_nm == 0


def test_on_ice_it_gains_speed_by_friction_alone() -> None:
    body = differential(mass_kg=10, friction=0.1)
    Driver(body).roll(1, 1, steps=200)  # the rims at 5 m/s from the first step on
    speed_m_s = 0.1 * GRAVITY_M_S2 * 0.2
    assert body.speed_m_s == pytest.approx(speed_m_s)
    assert body.pose.x_m == pytest.approx(speed_m_s * (0.2 + STEP_S) / 2)
    assert body.slipping
    left = body.contacts["left"]
    assert left.slip_m_s == pytest.approx(5 - speed_m_s)
    assert left.load_kg_m2 == 0
    assert left.load_nm == pytest.approx(-0.5 * GRAVITY_M_S2 * RADIUS)


def test_a_body_slides_on_when_its_wheels_are_held() -> None:
    body = differential(mass_kg=10, friction=0.5)
    body.contacts["left"].speed_m_s = body.contacts["right"].speed_m_s = 1.0
    body.step({"left": 0, "right": 0})
    assert body.contacts["left"].load_nm == pytest.approx(2.5 * GRAVITY_M_S2 * RADIUS)
    steps = 1
    while not body.resting:
        body.step({"left": 0, "right": 0})
        steps += 1
    assert body.pose.x_m == pytest.approx(1 / (2 * 0.5 * GRAVITY_M_S2), rel=0.01)
    assert steps * STEP_S == pytest.approx(1 / (0.5 * GRAVITY_M_S2), abs=2 * STEP_S)
    assert body.contacts["left"].load_nm == 0


@pytest.mark.unmeasured
@given(st.lists(st.floats(-0.01, 0.01), max_size=50), st.floats(0, 1))
def test_the_ground_never_changes_its_speed_faster_than_friction_allows(
    turns: list[float], friction: float
) -> None:
    contact = Contact(RADIUS, 1.0, friction)
    for turn in turns:
        before = contact.speed_m_s
        contact.roll(turn, STEP_S)
        assert abs(contact.speed_m_s - before) <= friction * GRAVITY_M_S2 * STEP_S + 1e-12


@pytest.mark.parametrize(
    ("wrong", "error"),
    [
        ({"kind": "hexapod"}, "kind 'hexapod' is not one of differential, skid-steer"),
        ({"wheel_radius_m": 0.0}, "wheel_radius_m 0.0 is not above 0"),
        ({"tread_m": float("nan")}, "tread_m nan is not above 0"),
        ({"mass_kg": -1.0}, "mass_kg -1.0 is not 0 or more"),
        ({"friction": -0.1}, "friction -0.1 is not 0 or more"),
    ],
)
def test_a_body_that_cannot_be_is_refused(wrong: dict[str, object], error: str) -> None:
    values: dict[str, object] = {"kind": "differential", "wheel_radius_m": 0.1, "tread_m": 0.4}
    with pytest.raises(ValueError, match=error):
        BodyParameters(**{**values, **wrong})  # type: ignore[arg-type] # wrong on purpose
