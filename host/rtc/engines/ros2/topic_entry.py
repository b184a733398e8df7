"""What joins a port with a topic, as a line of the table says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

_STOP_AFTER_US: Final = 500_000
"""Silence after which a velocity is taken back, if the table does not say otherwise."""

_VELOCITIES: Final = ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped")
PLACED: Final = ("nav_msgs/msg/Odometry", "tf2_msgs/msg/TFMessage")
FRAMES: Final = {
    **dict.fromkeys(PLACED, "odom"),
    "geometry_msgs/msg/PoseStamped": "odom",
    "geometry_msgs/msg/TwistStamped": "base_link",
    "sensor_msgs/msg/JointState": "",
    "sensor_msgs/msg/LaserScan": "laser",
}
"""`frame_id` of messages that have one, where the table names none."""


@dataclass(frozen=True, slots=True)
class TopicEntry:
    """A port and its topic.

    Attributes:
        port: full name, such as `Odometry.OdometryPosition`.
        topic: without the first slash, such as `odom`.
        type: the message, such as `nav_msgs/msg/Odometry`.
        frame: `frame_id` of the header.
        child_frame: the frame whose pose the message has.
        joints: names of the joints, in the order of the values.
        stop_after_us: time after the last message at which the port gets a zero value, such as
            standstill; 0 for never.
        reliable: whether messages are sent again until they arrive.
        place: file and line, for people; empty for an entry that is in no file.
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
        """Return how people call it."""
        return f"{self.place}: {self.port}" if self.place else self.port


def usual_entry(port: str, topic: str, kind: str) -> TopicEntry:
    """Return an entry with the default frames and stop if it has none."""
    stop_after_us = _STOP_AFTER_US * (kind in _VELOCITIES)
    child_frame = "base_link" if kind in PLACED else ""
    frame = FRAMES.get(kind, "")
    return TopicEntry(port, topic, kind, frame, child_frame, stop_after_us=stop_after_us)


@dataclass(frozen=True, slots=True)
class TopicTable:
    """The ports that have topics.

    Attributes:
        entries: an entry for each port of each topic; None joins every port that has a matching
            message type to a topic of its name.
        diagnostics: topic for the states of the components, empty for none.
        period_us: interval at which these are published.
    """

    entries: tuple[TopicEntry, ...] | None = None
    diagnostics: str = "diagnostics"
    period_us: int = 1_000_000
