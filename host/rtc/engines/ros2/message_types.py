"""Messages of ROS 2 as types of Cyclone DDS, made of their fields when they are first asked for.

>>> list(message_type("geometry_msgs/msg/Twist").__dataclass_fields__)
['linear', 'angular']
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from functools import cache
from typing import Any, Final

from tickrig.wire.rtc_types.rtc import Time

# Times of values and of messages: one counts from the start of a system, the other from 1970.

_FAR_US: Final = 1_000_000
"""A value that is farther from the present counts its time on another clock, or not at all."""

_ASTRAY_NS: Final = 10_000_000_000
"""A system that is so late, or a clock that was set, has the times related anew."""


class Stamps:
    """Converts between the time of a system and that of the machine.

    Values of one time have one stamp, so a pose and its transform do. A value whose time is
    more than 1 s off that of the system gets the present one. What a late system makes up for
    has the time at which it was due.

    Args:
        now_us: tells the time of the system.
        clock: nanoseconds since 1970.
    """

    def __init__(self, now_us: Callable[[], int], clock: Callable[[], int] = time.time_ns) -> None:
        self._now_us, self._clock = now_us, clock
        self.start()

    def start(self) -> None:
        """Relate the present times."""
        self._start_ns = self._clock() - 1_000 * self._now_us()

    def to_ros(self, tm: Time) -> tuple[int, int]:
        """Return the stamp of a value, in seconds and nanoseconds."""
        now_us, tm_us = self._now_us(), tm.us
        if not -_FAR_US <= tm_us - now_us <= _FAR_US:
            tm_us = now_us
        if not -_ASTRAY_NS <= self._start_ns + 1_000 * tm_us - self._clock() <= _ASTRAY_NS:
            self.start()
        return divmod(self._start_ns + 1_000 * tm_us, 1_000_000_000)

    def to_system(self, sec: int = 0, nanosec: int = 0) -> Time:
        """Return the time of a message that has this stamp, the present without one."""
        now_us = self._now_us()
        at_us = (sec * 1_000_000_000 + nanosec - self._start_ns) // 1_000
        if not -_FAR_US <= at_us - now_us <= _FAR_US:
            at_us = now_us
        return Time.from_us(max(0, at_us))


_HEADER: Final = "std_msgs/Header header"
_MULTI_ARRAY: Final = "std_msgs/MultiArrayLayout layout; {}[] data"

_FIELDS: Final = {
    "builtin_interfaces/msg/Time": "int32 sec; uint32 nanosec",
    "diagnostic_msgs/msg/DiagnosticArray": f"{_HEADER}; diagnostic_msgs/DiagnosticStatus[] status",
    "diagnostic_msgs/msg/DiagnosticStatus": "uint8 level; string name; string message;"
    " string hardware_id; diagnostic_msgs/KeyValue[] values",
    "diagnostic_msgs/msg/KeyValue": "string key; string value",
    "geometry_msgs/msg/Point": "float64 x; float64 y; float64 z",
    "geometry_msgs/msg/Pose": "geometry_msgs/Point position; geometry_msgs/Quaternion orientation",
    "geometry_msgs/msg/PoseStamped": f"{_HEADER}; geometry_msgs/Pose pose",
    "geometry_msgs/msg/PoseWithCovariance": "geometry_msgs/Pose pose; float64[36] covariance",
    "geometry_msgs/msg/Quaternion": "float64 x; float64 y; float64 z; float64 w",
    "geometry_msgs/msg/Transform": "geometry_msgs/Vector3 translation;"
    " geometry_msgs/Quaternion rotation",
    "geometry_msgs/msg/TransformStamped": f"{_HEADER}; string child_frame_id;"
    " geometry_msgs/Transform transform",
    "geometry_msgs/msg/Twist": "geometry_msgs/Vector3 linear; geometry_msgs/Vector3 angular",
    "geometry_msgs/msg/TwistStamped": f"{_HEADER}; geometry_msgs/Twist twist",
    "geometry_msgs/msg/TwistWithCovariance": "geometry_msgs/Twist twist; float64[36] covariance",
    "geometry_msgs/msg/Vector3": "float64 x; float64 y; float64 z",
    "nav_msgs/msg/Odometry": f"{_HEADER}; string child_frame_id;"
    " geometry_msgs/PoseWithCovariance pose; geometry_msgs/TwistWithCovariance twist",
    "sensor_msgs/msg/JointState": f"{_HEADER}; string[] name; float64[] position;"
    " float64[] velocity; float64[] effort",
    "sensor_msgs/msg/LaserScan": f"{_HEADER}; float32 angle_min; float32 angle_max;"
    " float32 angle_increment; float32 time_increment; float32 scan_time; float32 range_min;"
    " float32 range_max; float32[] ranges; float32[] intensities",
    "std_msgs/msg/Bool": "bool data",
    "std_msgs/msg/Float32": "float32 data",
    "std_msgs/msg/Float32MultiArray": _MULTI_ARRAY.format("float32"),
    "std_msgs/msg/Float64": "float64 data",
    "std_msgs/msg/Float64MultiArray": _MULTI_ARRAY.format("float64"),
    "std_msgs/msg/Header": "builtin_interfaces/Time stamp; string frame_id",
    "std_msgs/msg/Int16": "int16 data",
    "std_msgs/msg/Int16MultiArray": _MULTI_ARRAY.format("int16"),
    "std_msgs/msg/Int32": "int32 data",
    "std_msgs/msg/Int32MultiArray": _MULTI_ARRAY.format("int32"),
    "std_msgs/msg/MultiArrayDimension": "string label; uint32 size; uint32 stride",
    "std_msgs/msg/MultiArrayLayout": "std_msgs/MultiArrayDimension[] dim; uint32 data_offset",
    "std_msgs/msg/String": "string data",
    "std_msgs/msg/UInt16": "uint16 data",
    "std_msgs/msg/UInt16MultiArray": _MULTI_ARRAY.format("uint16"),
    "std_msgs/msg/UInt32": "uint32 data",
    "std_msgs/msg/UInt32MultiArray": _MULTI_ARRAY.format("uint32"),
    "std_msgs/msg/UInt8": "uint8 data",
    "std_msgs/msg/UInt8MultiArray": _MULTI_ARRAY.format("uint8"),
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms",
}
"""Fields by message, as its .msg file has them (common_interfaces 5.5.1, geometry2)."""

_PYTHON: Final[dict[str, Any]] = {"bool": bool, "string": str}
_FIELD: Final = re.compile(r"([\w/]+)(?:(\[)(\d*)\])? (\w+)")


@cache
def message_type(name: str) -> Any:
    """Return the class of a message; it is made with its fields in their order.

    Args:
        name: such as `geometry_msgs/msg/Twist`.

    Raises:
        KeyError: no message of this name is known here.
    """
    from cyclonedds.idl import make_idl_struct  # noqa: PLC0415 - an extra

    fields = dict(map(_field, _FIELDS[name].split("; ")))
    return make_idl_struct(name.rpartition("/")[2], dds_name(name), fields)


def dds_name(name: str) -> str:
    """Return how DDS calls a message (ROS 2, "Topic and Service name mapping to DDS").

    >>> dds_name("std_msgs/msg/Bool")
    'std_msgs::msg::dds_::Bool_'
    """
    package, _, kind = name.split("/")
    return f"{package}::msg::dds_::{kind}_"


def ros_name(name: str) -> str:
    """Return the message that DDS calls so; others as they are.

    >>> ros_name("std_msgs::msg::dds_::Bool_"), ros_name("HelloWorld")
    ('std_msgs/msg/Bool', 'HelloWorld')
    """
    match = re.fullmatch(r"(\w+)::msg::dds_::(\w+)_", name)
    return f"{match[1]}/msg/{match[2]}" if match else name


def _field(text: str) -> tuple[str, Any]:
    from cyclonedds.idl import types  # noqa: PLC0415 - an extra

    match = _FIELD.fullmatch(text.strip())
    assert match is not None, text
    kind, many, count, name = match.groups()
    if "/" in kind:
        one = message_type(kind.replace("/", "/msg/"))
    else:
        one = _PYTHON.get(kind) or getattr(types, kind)
    if not many:
        return name, one
    several: Any = types.array if count else types.sequence
    return name, several[one, int(count)] if count else several[one]
