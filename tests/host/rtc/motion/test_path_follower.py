from __future__ import annotations

from dataclasses import replace
from math import nan, sqrt
from typing import Any

import pytest

from tests.host.rtc.motion.port_bench import PortBench, at
from tickrig.host.rtc.motion.components.path_follower import PathFollower
from tickrig.host.rtc.motion.geometry import Twist
from tickrig.host.rtc.motion.ports import RunMode
from tickrig.wire.rtc_types.rtc import Path


def bench(set_id: str = "default", **settings: str) -> PortBench[PathFollower]:
    follower = PathFollower("PathFollower0")
    follower.configuration.activate(set_id)
    on = PortBench(follower, **settings)
    on.feed("position", at(0.0))
    on.period()
    return on


def twists(on: PortBench[PathFollower], *paths: Path, periods: int = 1) -> list[Twist]:
    """Return the commands of so many periods in which the cart stands at the origin."""
    on.taken("velocity")
    on.feed("target_path", *paths)
    for _ in range(periods):
        on.feed("position", at(0.0))
        on.period()
    return [Twist(each.data.vx, each.data.va) for each in on.taken("velocity")]


LINE = Path(RunMode.LINEFOLLOW, x=2.0, v=0.3)
STOP = Path(RunMode.STOP)


def test_it_commands_a_velocity_each_period_and_vy_never() -> None:
    on = bench()
    on.taken("velocity")
    on.period(5)
    assert [each.data.vy for each in on.taken("velocity")] == [0.0] * 5


def test_the_velocity_rises_by_the_acceleration_limit() -> None:
    on = bench()
    assert [t.v for t in twists(on, LINE, periods=4)] == pytest.approx([0.006, 0.012, 0.018, 0.024])


def test_it_goes_on_with_a_mode_until_the_next_message() -> None:
    on = bench()
    assert twists(on, LINE, periods=60)[-1] == pytest.approx((0.3, 0.0))
    assert twists(on, STOP, periods=60)[-1] == (0.0, 0.0)


@pytest.mark.parametrize(
    ("path", "twist"),
    [
        (Path(RunMode.FREE, v=1.0), (0.0, 0.0)),
        (Path(RunMode.STOP, v=1.0), (0.0, 0.0)),
        (Path(99, v=1.0), (0.0, 0.0)),
        (Path(RunMode.VEL, v=0.2, w=-0.1), (0.2, -0.1)),
        (Path(RunMode.VEL, v=9.0, w=-9.0), (1.0, -0.3)),
        (Path(RunMode.WHEEL_VEL, v=2.0, w=2.0), (0.199, 0.0)),
        (Path(RunMode.WHEEL_VEL, v=-0.5, w=0.5), (0.0, 0.0995 / 0.464)),
        (Path(RunMode.TO_POINT, x=0.2, v=0.3), (0.2, 0.0)),
        (Path(RunMode.TO_POINT, x=2.0, v=0.3), (0.3, 0.0)),
        (Path(RunMode.TO_POINT, x=-0.1, v=0.3), (0.0, 0.0)),
        (Path(RunMode.CIRCLEFOLLOW, x=0.0, y=2.0, r=2.0, v=0.3), (0.3, 0.15)),
        (Path(RunMode.CIRCLEFOLLOW, x=0.0, y=-2.0, r=-2.0, v=0.3), (0.3, -0.15)),
        (Path(RunMode.CIRCLEFOLLOW, v=0.3), (0.0, 0.0)),
        (Path(RunMode.SPIN, theta=2.0, w=1.0), (0.0, 0.3)),
        (Path(RunMode.SPIN, theta=-2.0, w=0.2), (0.0, -0.2)),
        (Path(RunMode.LINEFOLLOW, x=-2.0, v=-0.2), (-0.2, 0.0)),
    ],
)
def test_each_mode_settles_at_its_velocity(path: Path, twist: tuple[float, float]) -> None:
    assert twists(bench(), path, periods=300)[-1] == pytest.approx(twist, abs=1e-3)


@pytest.mark.parametrize("number", ["x", "theta", "v", "w", "r"])
def test_a_message_with_a_number_that_is_none_means_stop(number: str) -> None:
    on = bench()
    twists(on, LINE, periods=60)
    spoilt: dict[str, Any] = {number: nan}
    assert twists(on, replace(LINE, **spoilt), periods=60)[-1] == (0.0, 0.0)


def test_it_reads_one_message_a_period() -> None:
    on = bench()
    twists(on, LINE, STOP)
    assert on.component.path.type == RunMode.LINEFOLLOW
    twists(on)
    assert on.component.path.type == RunMode.STOP


def test_it_stands_until_it_has_a_pose() -> None:
    on = PortBench(PathFollower("PathFollower0"))
    on.feed("target_path", LINE)
    on.period(5)
    assert {each.data.vx for each in on.taken("velocity")} == {0.0}


def test_without_a_pose_for_half_a_second_it_stops() -> None:
    on = bench()
    twists(on, LINE, periods=60)
    on.period(25)
    assert on.component.twist.v == pytest.approx(0.3)
    on.period(60)
    assert on.component.twist == (0.0, 0.0)
    assert twists(on, periods=10)[-1].v == pytest.approx(0.06)


def test_a_pose_with_a_number_that_is_none_is_none() -> None:
    on = bench()
    twists(on, LINE, periods=60)
    for _ in range(90):
        on.feed("position", at(nan))
        on.period()
    assert on.component.twist == (0.0, 0.0)


def test_activation_begins_at_standstill() -> None:
    on = bench()
    twists(on, LINE, periods=60)
    on.deactivate()
    on.activate()
    assert twists(on, periods=5)[-1] == (0.0, 0.0)


def test_a_change_of_the_configuration_takes_effect_while_it_runs() -> None:
    on = bench()
    off = Path(RunMode.LINEFOLLOW, y=0.01, x=2.0, v=0.3)
    implicit = twists(on, off, periods=300)[-1].w
    on.component.configuration.set("line_K1", "400")
    assert twists(on, periods=300)[-1].w == pytest.approx(implicit / 2)


def test_the_literal_reading_of_max_acc_is_a_choice_of_acc_cycle() -> None:
    on = bench(acc_cycle="0.02")
    assert twists(on, LINE)[-1].v == pytest.approx(0.0003)


def test_the_historical_law_is_a_switch() -> None:
    off = Path(RunMode.LINEFOLLOW, y=0.001, x=2.0, v=0.3)
    explicit = twists(bench(law="explicit"), off)[-1].w
    assert explicit == pytest.approx(0.02 * 800 * 0.001)
    assert twists(bench(), off)[-1].w == pytest.approx(explicit / (1 + 0.02 * 400))


def test_the_tuned_set_spins_by_the_time_optimal_servo() -> None:
    spin = Path(RunMode.SPIN, theta=0.01, w=1.0)
    assert twists(bench("tuned"), spin)[-1].w == pytest.approx(0.01 / (0.02 + 0.08))
    assert twists(bench(), spin)[-1].w == pytest.approx(sqrt(0.01))
