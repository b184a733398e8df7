"""Odometry, and the files that it loads."""

from __future__ import annotations

from math import nan, pi
from pathlib import Path

import pytest

from tests.host.rtc.motion.port_bench import PortBench, at
from tickrig.host.rtc import RtcRefused
from tickrig.host.rtc.motion.components.odometry import Odometry, read_conf
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.wire.rtc_types.rtc import Time, TimedDoubleSeq

RADIUS, AXLE = 0.0995, 0.464


def bench(**settings: str) -> PortBench[Odometry]:
    return PortBench(Odometry("Odometry0"), **settings)


def turned(on: PortBench[Odometry], *angles: tuple[float, ...]) -> Pose:
    """Feed wheel angles and return the pose."""
    on.feed("CurrentWheelAngle", *(TimedDoubleSeq(Time(1, 2), each) for each in angles))
    on.period()
    return on.component.pose


def test_angles_are_absolute_and_the_first_ones_only_begin() -> None:
    on = bench()
    assert turned(on, (100.0, 200.0)) == Pose()
    assert turned(on, (110.0, 210.0)) == pytest.approx((10 * RADIUS, 0.0, 0.0))


def test_each_angle_gives_a_pose_with_its_time() -> None:
    on = bench()
    turned(on, (0.0, 0.0), (1.0, 1.0))
    poses = on.taken("OdometryPosition")
    assert [pose.data.position.x for pose in poses] == [0.0, RADIUS]
    assert {pose.tm for pose in poses} == {Time(1, 2)}


def test_wheels_that_turn_apart_turn_the_cart() -> None:
    on = bench()
    way = pi / 2 * AXLE / 2 / RADIUS
    assert turned(on, (0.0, 0.0), (-way, way)) == pytest.approx((0.0, 0.0, pi / 2))


def test_the_heading_stays_within_half_a_turn() -> None:
    on = bench(initialPose_theta="3.1")
    way = 0.1 * AXLE / 2 / RADIUS
    assert turned(on, (0.0, 0.0), (-way, way)).heading == pytest.approx(3.2 - 2 * pi)


@pytest.mark.parametrize(
    ("settings", "pose"),
    [
        ({"radiusOfRightWheel": "0.2", "radiusOfLeftWheel": "0.2"}, (0.2, 0.0, 0.0)),
        ({"radiusOfRightWheel": "0.1", "radiusOfLeftWheel": "0.2"}, (None, None, -0.1 / AXLE)),
        ({"lengthOfAxle": "0.3", "radiusOfLeftWheel": "0.0695"}, (None, None, 0.1)),
    ],
)
def test_radii_and_axle_come_from_the_configuration(
    settings: dict[str, str], pose: tuple[float | None, ...]
) -> None:
    seen = turned(bench(**settings), (0.0, 0.0), (1.0, 1.0))
    for value, wanted in zip(seen, pose, strict=True):
        assert wanted is None or value == pytest.approx(wanted)


def test_the_ids_say_which_angle_is_whose() -> None:
    on = bench(leftWheelID="1", rightWheelID="0")
    assert turned(on, (0.0, 0.0), (0.1, -0.1)).heading > 0


@pytest.mark.parametrize("angles", [(), (1.0,), (nan, 1.0), (1.0, nan)])
def test_angles_that_cannot_be_are_passed_over(angles: tuple[float, ...]) -> None:
    on = bench()
    assert turned(on, (0.0, 0.0), angles, (1.0, 1.0)).x == pytest.approx(RADIUS)


def test_deactivate_change_activate_sets_the_pose() -> None:
    on = bench()
    turned(on, (0.0, 0.0), (5.0, 5.0))
    on.deactivate()
    for name, text in (("x", "3.0"), ("y", "4.0"), ("theta", "7.0")):
        on.component.configuration.set(f"initialPose_{name}", text)
    turned(on, (9.0, 9.0))
    on.activate()
    assert on.component.pose == pytest.approx((3.0, 4.0, 7.0 - 2 * pi))
    assert turned(on, (20.0, 20.0)) == pytest.approx((3.0, 4.0, 7.0 - 2 * pi))


def test_what_localisation_says_is_not_used() -> None:
    on = bench()
    on.feed("LocalizedPosition", at(5.0))
    assert turned(on, (0.0, 0.0)) == Pose()


TEXT = """\
# Odometry.conf
exec_cxt.periodic.rate: 50
conf.default.lengthOfAxle: 0.470   # on carpet
conf.carpet.radiusOfLeftWheel = 0.099
"""


def test_values_are_read_by_set_and_name(tmp_path: Path) -> None:
    path = tmp_path / "Odometry.conf"
    path.write_text(TEXT)
    assert read_conf(path) == {
        "default": {"lengthOfAxle": "0.470"},
        "carpet": {"radiusOfLeftWheel": "0.099"},
    }


def test_values_of_the_file_take_the_place_of_the_defaults(tmp_path: Path) -> None:
    path = tmp_path / "Odometry.conf"
    path.write_text(TEXT)
    odometry = Odometry("Odometry0")
    odometry.load(path)
    odometry.configuration.update()
    assert (odometry.axle.value, odometry.left_radius.value) == (0.47, 0.0995)
    odometry.configuration.activate("carpet")
    odometry.configuration.update()
    assert (odometry.axle.value, odometry.left_radius.value) == (0.464, 0.099)


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("conf.default: 1", "Odometry.conf:1: 'conf.default: 1' is not conf.SET.NAME: VALUE"),
        ("conf.default.axle: 1", "no parameter 'axle'; known: leftWheelID"),
        ("conf.default.lengthOfAxle: -1", "lengthOfAxle = -1 is not in x>0 m"),
        ("conf.default.lengthOfAxle: wide", "lengthOfAxle takes a value like 0.464 (float)"),
    ],
)
def test_a_mistake_in_the_file_is_refused(tmp_path: Path, line: str, told: str) -> None:
    path = tmp_path / "Odometry.conf"
    path.write_text(line)
    with pytest.raises(RtcRefused) as refused:
        Odometry("Odometry0").load(path)
    assert told in str(refused.value)
