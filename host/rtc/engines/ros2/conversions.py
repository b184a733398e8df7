"""The messages of ROS 2 for values of ports, and conversions in both directions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from tickrig.host.rtc.engines.ros2 import robot_messages as robot
from tickrig.host.rtc.engines.ros2.message_types import Stamps, message_type
from tickrig.host.rtc.engines.ros2.topic_entry import TopicEntry
from tickrig.wire.rtc_types import iis, rtc
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.rtc import ActArrayState, RangeData

_Conversion = Callable[[Any], Any]
_Maker = Callable[[TopicEntry, Stamps], _Conversion]
"""Function that makes a converter for the values, or the messages, of one port."""

_VALUES: Final[tuple[tuple[str, type[Struct]], ...]] = (
    ("std_msgs/msg/Bool", rtc.TimedBoolean),
    ("std_msgs/msg/Float32", rtc.TimedFloat),
    ("std_msgs/msg/Float64", rtc.TimedDouble),
    ("std_msgs/msg/Int16", rtc.TimedShort),
    ("std_msgs/msg/Int16", rtc.TimedState),
    ("std_msgs/msg/Int32", rtc.TimedLong),
    ("std_msgs/msg/String", rtc.TimedString),
    ("std_msgs/msg/UInt16", rtc.TimedUShort),
    ("std_msgs/msg/UInt32", rtc.TimedULong),
    ("std_msgs/msg/UInt8", rtc.TimedOctet),
)
_ARRAYS: Final[tuple[tuple[str, type[Struct]], ...]] = (
    ("std_msgs/msg/Float32MultiArray", rtc.TimedFloatSeq),
    ("std_msgs/msg/Float64MultiArray", rtc.TimedDoubleSeq),
    ("std_msgs/msg/Int16MultiArray", rtc.TimedShortSeq),
    ("std_msgs/msg/Int32MultiArray", rtc.TimedLongSeq),
    ("std_msgs/msg/UInt16MultiArray", rtc.TimedUShortSeq),
    ("std_msgs/msg/UInt32MultiArray", rtc.TimedULongSeq),
    ("std_msgs/msg/UInt8MultiArray", rtc.TimedOctetSeq),
)
_POSES: Final = (iis.TimedPose2D, rtc.TimedPose2D)
_SPEEDS: Final = (iis.TimedVelocity2D, rtc.TimedVelocity2D)
_ANGLES: Final = (rtc.TimedDoubleSeq, rtc.TimedFloatSeq, rtc.TimedDouble, rtc.TimedFloat)


def _data_out(entry: TopicEntry, stamps: Stamps) -> _Conversion:
    """Return a function that makes a message with only the field `data`."""
    kind = message_type(entry.type)
    return lambda value: kind(value.data)


def _array_out(entry: TopicEntry, stamps: Stamps) -> _Conversion:
    """Return a function that makes a message with a layout, which stays empty."""
    kind, layout = message_type(entry.type), message_type("std_msgs/msg/MultiArrayLayout")([], 0)
    return lambda value: kind(layout, list(value.data))


def _data_in(make: Any, entry: TopicEntry, stamps: Stamps) -> _Conversion:
    """Return a function that makes a value from the field `data` of a message."""
    return lambda message: make(stamps.to_system(), message.data)


def _array_in(make: Any, entry: TopicEntry, stamps: Stamps) -> _Conversion:
    whole: Callable[[Any], Any] = bytes if make is rtc.TimedOctetSeq else tuple
    return lambda message: make(stamps.to_system(), whole(message.data))


OUT: Final[Mapping[tuple[str, type[Struct]], _Maker]] = {
    **{("nav_msgs/msg/Odometry", kind): robot.odometry_out for kind in _POSES},
    ("nav_msgs/msg/Odometry", rtc.TimedPoseVel2D): robot.pose_vel_out,
    **{("tf2_msgs/msg/TFMessage", kind): robot.transform_out for kind in _POSES},
    **{("geometry_msgs/msg/PoseStamped", kind): robot.pose_out for kind in _POSES},
    **{("geometry_msgs/msg/Twist", kind): robot.twist_out for kind in _SPEEDS},
    **{("geometry_msgs/msg/TwistStamped", kind): robot.twist_stamped_out for kind in _SPEEDS},
    **{("sensor_msgs/msg/JointState", kind): robot.joints_out for kind in _ANGLES},
    ("sensor_msgs/msg/JointState", ActArrayState): robot.actuators_out,
    ("sensor_msgs/msg/LaserScan", RangeData): robot.scan_out,
    **dict.fromkeys(_VALUES, _data_out),
    **dict.fromkeys(_ARRAYS, _array_out),
}
"""Conversions for an OutPort. The first message that fits a type is the default."""

IN: Final[Mapping[tuple[str, type[Struct]], _Maker]] = {
    **{("geometry_msgs/msg/Twist", kind): partial(robot.twist_in, kind) for kind in _SPEEDS},
    **{("geometry_msgs/msg/TwistStamped", kind): partial(robot.twist_in, kind) for kind in _SPEEDS},
    **{("geometry_msgs/msg/PoseStamped", kind): partial(robot.pose_in, kind) for kind in _POSES},
    **{(name, kind): partial(_data_in, kind) for name, kind in _VALUES},
    **{(name, kind): partial(_array_in, kind) for name, kind in _ARRAYS},
}
"""Conversions for an InPort."""

MESSAGES: Final = tuple(sorted({name for name, _ in (*OUT, *IN)}))
"""Messages that a table can name."""
