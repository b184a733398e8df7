"""Values of ports as messages, and back."""

from __future__ import annotations

from dataclasses import replace
from math import cos, inf, pi, sin
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.rtc.engines.ros2.extra import CYCLONE
from tickrig.host.rtc.engines.ros2.conversions import IN, OUT
from tickrig.host.rtc.engines.ros2.message_types import Stamps
from tickrig.host.rtc.engines.ros2.topic_entry import usual_entry
from tickrig.wire.rtc_types import iis, rtc
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.rtc import (
    ActArrayState,
    Actuator,
    Point2D,
    Pose2D,
    PoseVel2D,
    RangeData,
    RangerConfig,
    Time,
    Velocity2D,
)

pytestmark = CYCLONE

NOW_NS = 1_700_000_000_250_000_000
START_NS = 1_700_000_000_000_000_000


def out(kind: str, value: Struct, *more: Struct, joints: tuple[str, ...] = ()) -> Any:
    """Return the message of the last value, its bytes decoded again."""

    entry = replace(usual_entry("A0.out", "a", kind), joints=joints)
    convert = OUT[kind, type(value)](entry, stamps())
    message: Any = [convert(each) for each in (value, *more)][-1]
    return type(message).deserialize(message.serialize(use_version_2=False))


def into(kind: str, data_type: type[Struct], message: Any) -> Any:
    return IN[kind, data_type](usual_entry("A0.in", "a", kind), stamps())(message)


def stamps() -> Stamps:
    return Stamps(lambda: 250_000, lambda: NOW_NS)


def pose(x: float, y: float, heading: float, at_us: int = 0) -> iis.TimedPose2D:
    return iis.TimedPose2D(Time.from_us(at_us), data=Pose2D(Point2D(x, y), heading))


def test_all_data_types_of_std_msgs_go_both_ways() -> None:
    kinds = [(name, kind) for name, kind in IN if name.startswith("std_msgs/")]
    assert len(kinds) == 17
    for name, kind in kinds:
        make: Any = kind
        zero = make()
        sample = {bool: True, int: 7, float: 0.5, str: "grün", bytes: b"\x01\xff", tuple: (2, 3)}
        value = make(Time(0, 250_000_000), sample[type(zero.data)])
        assert into(name, kind, out(name, value)) == value


def test_a_stamp_is_the_time_of_its_value_or_the_present() -> None:
    near = out("geometry_msgs/msg/PoseStamped", pose(0, 0, 0, 200_000)).header.stamp
    far = out("geometry_msgs/msg/PoseStamped", pose(0, 0, 0, 9_000_000_000)).header.stamp
    assert (near.sec, near.nanosec) == (1_700_000_000, 200_000_000)
    assert (far.sec, far.nanosec) == (1_700_000_000, 250_000_000)


def test_a_system_that_is_far_behind_gets_the_time_of_the_machine() -> None:
    clock = [START_NS]
    made = Stamps(lambda: 0, lambda: clock[0])
    clock[0] += 9_000_000_000
    assert made.to_ros(Time()) == (1_700_000_000, 0)
    clock[0] += 2_000_000_000
    assert made.to_ros(Time()) == (1_700_000_011, 0)
    assert made.to_system(1_700_000_011, 500_000) == Time(0, 500_000)


@given(st.floats(-pi, pi), st.floats(-100, 100), st.floats(-100, 100))
def test_a_pose_comes_back_as_it_was(heading: float, x: float, y: float) -> None:
    kind = "geometry_msgs/msg/PoseStamped"
    back = into(kind, iis.TimedPose2D, out(kind, pose(x, y, heading))).data
    assert (back.position.x, back.position.y) == (x, y)
    assert (cos(back.heading), sin(back.heading)) == pytest.approx((cos(heading), sin(heading)))


def test_the_velocity_of_odometry_is_that_on_an_arc_between_two_poses() -> None:
    radius, turn = 2.0, 0.25
    there = pose(radius * sin(turn), radius * (1 - cos(turn)), turn, 100_000)
    first = out("nav_msgs/msg/Odometry", pose(0, 0, 0)).twist.twist
    twist = out("nav_msgs/msg/Odometry", pose(0, 0, 0), there).twist.twist
    assert (first.linear.x, first.angular.z) == (0.0, 0.0)
    assert (twist.linear.x, twist.angular.z) == pytest.approx((5.0, 2.5))
    over = out("nav_msgs/msg/Odometry", pose(0, 0, 3.1), pose(0, 0, -3.1, 100_000)).twist.twist
    assert over.angular.z == pytest.approx((2 * pi - 6.2) / 0.1)


def test_a_pose_with_its_velocity_is_odometry_with_that() -> None:
    data = PoseVel2D(Pose2D(Point2D(1, 2), 0), Velocity2D(0.5, 0.25, -1))
    twist = out("nav_msgs/msg/Odometry", rtc.TimedPoseVel2D(data=data)).twist.twist
    assert (twist.linear.x, twist.linear.y, twist.angular.z) == (0.5, 0.25, -1.0)


@pytest.mark.parametrize("kind", ["geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"])
@pytest.mark.parametrize("data_type", [iis.TimedVelocity2D, rtc.TimedVelocity2D])
def test_a_velocity_comes_back_as_it_was(kind: str, data_type: Any) -> None:
    value = data_type(Time(0, 250_000_000), data=Velocity2D(0.5, -0.25, 1))
    assert into(kind, data_type, out(kind, value)) == value


def test_joints_have_the_names_of_the_table_or_numbers() -> None:
    kind, value = "sensor_msgs/msg/JointState", rtc.TimedDoubleSeq(data=(1.0, -2.0))
    assert out(kind, value, joints=("left", "right")).name == ["left", "right"]
    assert out(kind, value).name == ["joint0", "joint1"]
    assert out(kind, rtc.TimedDouble(data=3.0), joints=("arm",)).position == [3.0]
    with pytest.raises(ValueError, match=r"^2 joints, and 1 names: left$"):
        out(kind, value, joints=("left",))


def test_actuators_are_joints_with_their_speeds() -> None:
    state = ActArrayState(actuators=(Actuator(1.0, 0.5), Actuator(-1.0, 0.25)))
    message = out("sensor_msgs/msg/JointState", state)
    assert (message.position, message.velocity) == ([1.0, -1.0], [0.5, 0.25])


def test_a_scan_has_no_end_where_there_was_no_distance() -> None:
    config = RangerConfig(-0.5, 9.0, 0.25, 0.0625, 4.0, 0.001, 10.0)
    scan = out("sensor_msgs/msg/LaserScan", RangeData(ranges=(1.0, 0.0, 2.0), config=config))
    assert (scan.ranges, scan.header.frame_id) == ([1.0, inf, 2.0], "laser")
    assert (scan.angle_min, scan.angle_max, scan.angle_increment) == (-0.5, 0.0, 0.25)
    assert (scan.range_min, scan.range_max) == (0.0625, 4.0)
    assert scan.scan_time == pytest.approx(0.1)
    still = out("sensor_msgs/msg/LaserScan", RangeData(ranges=(1.0,)))
    assert (still.scan_time, still.angle_max) == (0.0, 0.0)
