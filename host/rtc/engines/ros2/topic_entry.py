"""The entry that joins a port with a topic, which is a line of the table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

_STOP_AFTER_US: Final = 500_000
"""Default silence after which a velocity is set to zero."""

_VELOCITIES: Final = ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped")
PLACED: Final = ("nav_msgs/msg/Odometry", "tf2_msgs/msg/TFMessage")
FRAMES: Final = {
    **dict.fromkeys(PLACED, "odom"),
    "geometry_msgs/msg/PoseStamped": "odom",
    "geometry_msgs/msg/TwistStamped": "base_link",
    "sensor_msgs/msg/JointState": "",
    "sensor_msgs/msg/LaserScan": "laser",
}
"""Default `frame_id` of messages that have one."""


@dataclass(frozen=True, slots=True)
class TopicEntry:
    """An entry of the table of topics: a port, its topic, and the settings for the messages.

    Attributes:
        port: full name of the port, such as `Odometry.OdometryPosition`.
        topic: name of the topic without the first slash, such as `odom`.
        type: type of the message, such as `nav_msgs/msg/Odometry`.
        frame: value of `frame_id` in the header.
        child_frame: frame whose pose is in the message.
        joints: names of the joints, in the order of the values.
        stop_after_us: time after the last message at which the port gets a zero value, such as
            standstill, or 0 for never.
        reliable: whether messages are sent again until they arrive.
        place: file and line for display, empty for an entry that is in no file.
    """

    port: str
    topic: str
    type: str
    frame: str = ""
    child_frame: str = ""
    joints: tuple[str, ...] = ()
    stop_after_us: int = 0
    reliable: bool = True
    place: str = ""

    def __str__(self) -> str:
        """Return the entry as text for the user."""
        return f"{self.place}: {self.port}" if self.place else self.port


def usual_entry(port: str, topic: str, kind: str) -> TopicEntry:
    """Return an entry for a message type, with default coordinate frames and `stop_after_us`."""
    stop_after_us = _STOP_AFTER_US * (kind in _VELOCITIES)
    child_frame = "base_link" if kind in PLACED else ""
    frame = FRAMES.get(kind, "")
    return TopicEntry(port, topic, kind, frame, child_frame, stop_after_us=stop_after_us)


@dataclass(frozen=True, slots=True)
class TopicTable:
    """Table that assigns ports of components to ROS 2 topics.

    Attributes:
        entries: entries with a port and a topic each. None means that each port with a matching
            message type has a topic of the same name as the port.
        diagnostics: topic for the states of the components, empty for none.
        period_us: interval in us at which the states of the components are published.
    """

    entries: tuple[TopicEntry, ...] | None = None
    diagnostics: str = "diagnostics"
    period_us: int = 1_000_000
