"""Messages of ROS 2 as types of Cyclone DDS. Each type is made from its fields at its first use.

>>> list(message_type("geometry_msgs/msg/Twist").__dataclass_fields__)
['linear', 'angular']
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, Final

from tickrig.wire.rtc_types.rtc import Time

# Times of values and of messages: one counts from the start of a system, the other from 1970.

_FAR_US: Final = 1_000_000
"""Distance from the present above which a value's time is of another clock, or not a time."""

_ASTRAY_NS: Final = 10_000_000_000
"""Delay of a system, or change of a clock, after which the offset between times is updated."""


class Stamps:
    """Converts times of a system to time stamps of ROS messages, and back.

    The times of the system count from its start, and the time stamps of ROS count from 1970.

    Values with equal times get equal stamps, for example a pose and its transform. If the time of a
    value differs by more than 1 s from the time of the system, the present time of the system is
    used instead. If a system runs behind real time, the stamps of its values are the times at which
    the values were due, not the times at which they were written.

    Args:
        now_us: function that returns the time of the system in us.
        clock: function that returns nanoseconds since 1970.
    """

    def __init__(self, now_us: Callable[[], int], clock: Callable[[], int] = time.time_ns) -> None:
        self._now_us, self._clock = now_us, clock
        self.start()

    def start(self) -> None:
        """Relate the present time of the system to the present time of the machine."""
        self._start_ns = self._clock() - 1_000 * self._now_us()

    def to_ros(self, tm: Time) -> tuple[int, int]:
        """Return the time stamp for a value of the system, in seconds and nanoseconds."""
        now_us, tm_us = self._now_us(), tm.us
        if not -_FAR_US <= tm_us - now_us <= _FAR_US:
            tm_us = now_us
        if not -_ASTRAY_NS <= self._start_ns + 1_000 * tm_us - self._clock() <= _ASTRAY_NS:
            self.start()
        return divmod(self._start_ns + 1_000 * tm_us, 1_000_000_000)

    def to_system(self, sec: int = 0, nanosec: int = 0) -> Time:
        """Convert the time stamp of a ROS message to the time since the start of the RTC system.

        Without a stamp, the result is the present time of the system.
        """
        now_us = self._now_us()
        at_us = (sec * 1_000_000_000 + nanosec - self._start_ns) // 1_000
        if not -_FAR_US <= at_us - now_us <= _FAR_US:
            at_us = now_us
        return Time.from_us(max(0, at_us))


def _read_fields(text: str) -> dict[str, str]:
    lines = (line.partition(": ") for line in text.splitlines() if not line.startswith("#"))
    return {name: fields for name, _, fields in lines}


_FIELDS: Final = _read_fields(Path(__file__).with_name("messages.txt").read_text("utf-8"))
"""Fields of messages by the name of the message."""

_PYTHON: Final[dict[str, Any]] = {"bool": bool, "string": str}
_FIELD: Final = re.compile(r"([\w/]+)(?:(\[)(\d*)\])? (\w+)")


@cache
def message_type(name: str) -> Any:
    """Return the Python class of a ROS 2 message, for Cyclone DDS.

    Its fields have the order of the message definition.

    Args:
        name: name of the message, such as `geometry_msgs/msg/Twist`.

    Raises:
        KeyError: the message is unknown.
    """
    from cyclonedds.idl import make_idl_struct  # noqa: PLC0415 - an extra

    fields = dict(map(_field, _FIELDS[name].split("; ")))
    return make_idl_struct(name.rpartition("/")[2], dds_name(name), fields)


def dds_name(name: str) -> str:
    """Return the DDS type name of a ROS message (ROS 2, "Topic and Service name mapping to DDS").

    >>> dds_name("std_msgs/msg/Bool")
    'std_msgs::msg::dds_::Bool_'
    """
    package, _, kind = name.split("/")
    return f"{package}::msg::dds_::{kind}_"


def ros_name(name: str) -> str:
    """Return the name of a ROS message from its DDS type name. Other names are returned unchanged.

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
