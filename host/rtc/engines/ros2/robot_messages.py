"""Conversion of poses, velocities, joints and ranges to messages of ROS 2, and back.

Lengths are in m and angles in rad. Frames follow REP 103: x ahead, y to the left, z up. A pose in
the plane has z = 0, and a heading is a rotation about z. Covariances stay 0, which means unknown.
"""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, cos, inf, pi, sin, tau
from typing import Any, Final

from tickrig.host.rtc.engines.ros2.message_types import Stamps, message_type
from tickrig.host.rtc.engines.ros2.topic_entry import TopicEntry
from tickrig.wire.rtc_types.rtc import Point2D, Pose2D, RangeData, Time, Velocity2D

_UNKNOWN: Final = [0.0] * 36
"""An unknown covariance."""

_STRAIGHT: Final = 1e-9
"""Angle below which a turn counts as none, in rad."""


def odometry_out(entry: TopicEntry, stamps: Stamps) -> Callable[[Any], Any]:
    """Return a function that converts a pose in the plane to an Odometry message.

    The velocity in the message is calculated from the previous pose.
    """
    make, speed = _odometry(entry, stamps), _Speed()
    return lambda value: make(value.tm, value.data, speed.since(value.tm, value.data))


def pose_vel_out(entry: TopicEntry, stamps: Stamps) -> Callable[[Any], Any]:
    """Return a function that converts a pose with its velocity to an Odometry message."""
    make = _odometry(entry, stamps)
    return lambda value: make(value.tm, value.data.pose, value.data.velocities)


def transform_out(entry: TopicEntry, stamps: Stamps) -> Callable[[Any], Any]:
    """Return a function that converts a pose to a TFMessage with one transform."""
    header, vector, turned = _header(entry, stamps), _vector(), _turned()
    stamped = message_type("geometry_msgs/msg/TransformStamped")
    transform, message = message_type("geometry_msgs/msg/Transform"), message_type(entry.type)

    def convert(value: Any) -> Any:
        place = value.data.position
        moved = transform(vector(place.x, place.y, 0.0), turned(value.data.heading))
        return message([stamped(header(value.tm), entry.child_frame, moved)])

    return convert


def pose_out(entry: TopicEntry, stamps: Stamps) -> Callable[[Any], Any]:
    """Return a function that converts a pose to a PoseStamped message."""
    header, pose, message = _header(entry, stamps), _pose(), message_type(entry.type)
    return lambda value: message(header(value.tm), pose(value.data))


def pose_in(data_type: Any, entry: TopicEntry, stamps: Stamps) -> Callable[[Any], Any]:
    """Return a function that converts a PoseStamped message to a pose in the plane.

    The orientation of the message is reduced to a heading, so that a tilt is lost.
    """

    def convert(message: Any) -> Any:
        stamp, pose = message.header.stamp, message.pose
        place, q = pose.position, pose.orientation
        heading = atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
        tm = stamps.to_system(stamp.sec, stamp.nanosec)
        return data_type(tm, data=Pose2D(Point2D(place.x, place.y), heading))

    return convert


def twist_out(entry: TopicEntry, stamps: Stamps) -> Callable[[Any], Any]:
    """Return a function that converts a velocity in the plane to a Twist message."""
    twist = _twist()
    return lambda value: twist(value.data)


def twist_stamped_out(entry: TopicEntry, stamps: Stamps) -> Callable[[Any], Any]:
    """Return a function that converts a velocity in the plane to a TwistStamped message."""
    header, twist, message = _header(entry, stamps), _twist(), message_type(entry.type)
    return lambda value: message(header(value.tm), twist(value.data))


def twist_in(data_type: Any, entry: TopicEntry, stamps: Stamps) -> Callable[[Any], Any]:
    """Return a function that converts a Twist(Stamped) message to a velocity in the plane."""
    stamped = entry.type.endswith("Stamped")

    def convert(message: Any) -> Any:
        twist = message.twist if stamped else message
        speeds = Velocity2D(twist.linear.x, twist.linear.y, twist.angular.z)
        return data_type(stamps.to_system(), data=speeds)

    return convert


def joints_out(entry: TopicEntry, stamps: Stamps) -> Callable[[Any], Any]:
    """Return a function that converts positions of joints to a JointState message."""
    header, message = _header(entry, stamps), message_type(entry.type)

    def convert(value: Any) -> Any:
        data = value.data
        positions = list(data) if isinstance(data, tuple) else [data]
        return message(header(value.tm), _named(entry, positions), positions, [], [])

    return convert


def actuators_out(entry: TopicEntry, stamps: Stamps) -> Callable[[Any], Any]:
    """Return a function that converts the state of actuators to a JointState message."""
    header, message = _header(entry, stamps), message_type(entry.type)

    def convert(value: Any) -> Any:
        positions = [each.position for each in value.actuators]
        speeds = [each.speed for each in value.actuators]
        return message(header(value.tm), _named(entry, positions), positions, speeds, [])

    return convert


def scan_out(entry: TopicEntry, stamps: Stamps) -> Callable[[Any], Any]:
    """Return a function that converts the distances of a range scan to a LaserScan message.

    A missing distance becomes infinity (REP 117).
    """
    header, message = _header(entry, stamps), message_type(entry.type)

    def convert(value: RangeData) -> Any:
        config, ranges = value.config, [range_m or inf for range_m in value.ranges]
        turn_s = 1 / config.frequency if config.frequency > 0 else 0.0
        low, step = config.minAngle, config.angularRes
        high = low + step * max(0, len(ranges) - 1)
        times = (turn_s * step / tau, turn_s)
        limits = (config.minRange, config.maxRange)
        return message(header(value.tm), low, high, step, *times, *limits, ranges, [])

    return convert


class _Speed:
    """The velocity between poses, on an arc that begins and ends along their headings."""

    def __init__(self) -> None:
        self._before: tuple[Time, Pose2D] | None = None

    def since(self, tm: Time, pose: Pose2D) -> Velocity2D:
        """Return the mean velocity between the previous pose and this pose.

        The previous pose is the pose of the previous call. The forward velocity is in m/s, and the
        angular velocity in rad/s. The first call returns 0 for both.
        """
        before, self._before = self._before, (tm, pose)
        if before is None or (past_us := tm.us - before[0].us) <= 0:
            return Velocity2D()
        start, turn = before[1], (pose.heading - before[1].heading + pi) % tau - pi
        middle, half = start.heading + turn / 2, turn / 2
        east, north = pose.position.x - start.position.x, pose.position.y - start.position.y
        chord = east * cos(middle) + north * sin(middle)
        way = chord * half / sin(half) if abs(half) > _STRAIGHT else chord
        return Velocity2D(1e6 * way / past_us, 0.0, 1e6 * turn / past_us)


def _named(entry: TopicEntry, positions: list[float]) -> list[str]:
    """Return the names of joints. Raise ValueError if their number in the table is wrong."""
    names = list(entry.joints) or [f"joint{n}" for n in range(len(positions))]
    if len(names) != len(positions):
        raise ValueError(f"{len(positions)} joints, and {len(names)} names: {', '.join(names)}")
    return names


def _header(entry: TopicEntry, stamps: Stamps) -> Callable[[Time], Any]:
    header, stamp = message_type("std_msgs/msg/Header"), message_type("builtin_interfaces/msg/Time")
    return lambda tm: header(stamp(*stamps.to_ros(tm)), entry.frame)


def _vector() -> Any:
    return message_type("geometry_msgs/msg/Vector3")


def _turned() -> Callable[[float], Any]:
    quaternion = message_type("geometry_msgs/msg/Quaternion")
    return lambda heading: quaternion(0.0, 0.0, sin(heading / 2), cos(heading / 2))


def _pose() -> Callable[[Pose2D], Any]:
    pose, point = message_type("geometry_msgs/msg/Pose"), message_type("geometry_msgs/msg/Point")
    turned = _turned()
    return lambda data: pose(point(data.position.x, data.position.y, 0.0), turned(data.heading))


def _twist() -> Callable[[Velocity2D], Any]:
    twist, vector = message_type("geometry_msgs/msg/Twist"), _vector()
    return lambda speeds: twist(vector(speeds.vx, speeds.vy, 0.0), vector(0.0, 0.0, speeds.va))


def _odometry(entry: TopicEntry, stamps: Stamps) -> Callable[..., Any]:
    header, pose, twist = _header(entry, stamps), _pose(), _twist()
    placed = message_type("geometry_msgs/msg/PoseWithCovariance")
    moving = message_type("geometry_msgs/msg/TwistWithCovariance")
    message = message_type(entry.type)
    return lambda tm, at, speeds: message(
        header(tm),
        entry.child_frame,
        placed(pose(at), _UNKNOWN),
        moving(twist(speeds), _UNKNOWN),
    )
