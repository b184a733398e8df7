"""The messages of ROS 2 for values of ports, and conversions in both directions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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

_STD: Final[Mapping[str, tuple[type[Struct], ...]]] = {
    "Bool": (rtc.TimedBoolean,),
    "Float32": (rtc.TimedFloat,),
    "Float64": (rtc.TimedDouble,),
    "Int16": (rtc.TimedShort, rtc.TimedState),
    "Int32": (rtc.TimedLong,),
    "String": (rtc.TimedString,),
    "UInt16": (rtc.TimedUShort,),
    "UInt32": (rtc.TimedULong,),
    "UInt8": (rtc.TimedOctet,),
    "Float32MultiArray": (rtc.TimedFloatSeq,),
    "Float64MultiArray": (rtc.TimedDoubleSeq,),
    "Int16MultiArray": (rtc.TimedShortSeq,),
    "Int32MultiArray": (rtc.TimedLongSeq,),
    "UInt16MultiArray": (rtc.TimedUShortSeq,),
    "UInt32MultiArray": (rtc.TimedULongSeq,),
    "UInt8MultiArray": (rtc.TimedOctetSeq,),
}
_POSES: Final = (iis.TimedPose2D, rtc.TimedPose2D)
_SPEEDS: Final = (iis.TimedVelocity2D, rtc.TimedVelocity2D)
_ANGLES: Final = (rtc.TimedDoubleSeq, rtc.TimedFloatSeq, rtc.TimedDouble, rtc.TimedFloat)


def _data_out(name: str) -> _Maker:
    """Return a function that makes a message with only the field `data`."""

    def maker(entry: TopicEntry, stamps: Stamps) -> _Conversion:
        kind = message_type(name)
        return lambda value: kind(value.data)

    return maker


def _array_out(name: str) -> _Maker:
    """Return a function that makes a message with a layout, which stays empty."""

    def maker(entry: TopicEntry, stamps: Stamps) -> _Conversion:
        kind, layout = message_type(name), message_type("std_msgs/msg/MultiArrayLayout")([], 0)
        return lambda value: kind(layout, list(value.data))

    return maker


def _data_in(data_type: type[Struct]) -> _Maker:
    """Return a function that makes a value from the field `data` of a message."""
    make: Any = data_type
    return lambda entry, stamps: lambda message: make(stamps.to_system(), message.data)


def _array_in(data_type: type[Struct]) -> _Maker:
    make: Any = data_type
    whole: Callable[[Any], Any] = bytes if data_type is rtc.TimedOctetSeq else tuple
    return lambda entry, stamps: lambda message: make(stamps.to_system(), whole(message.data))


def _std() -> tuple[dict[tuple[str, type[Struct]], _Maker], ...]:
    out, into = dict[tuple[str, type[Struct]], _Maker](), dict[tuple[str, type[Struct]], _Maker]()
    for short, kinds in _STD.items():
        name, many = f"std_msgs/msg/{short}", short.endswith("MultiArray")
        for kind in kinds:
            out[name, kind] = _array_out(name) if many else _data_out(name)
            into[name, kind] = _array_in(kind) if many else _data_in(kind)
    return out, into


_STD_OUT, _STD_IN = _std()

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
    **_STD_OUT,
}
"""Conversions for an OutPort. The first message that fits a type is the default."""

IN: Final[Mapping[tuple[str, type[Struct]], _Maker]] = {
    **{("geometry_msgs/msg/Twist", kind): robot.twist_in(kind) for kind in _SPEEDS},
    **{("geometry_msgs/msg/TwistStamped", kind): robot.twist_in(kind) for kind in _SPEEDS},
    **{("geometry_msgs/msg/PoseStamped", kind): robot.pose_in(kind) for kind in _POSES},
    **_STD_IN,
}
"""Conversions for an InPort."""

MESSAGES: Final = tuple(sorted({name for name, _ in (*OUT, *IN)}))
"""Messages that a table can name."""
