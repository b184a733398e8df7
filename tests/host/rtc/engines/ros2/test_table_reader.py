"""The table of ports and topics: what it says, and all that is wrong with it at once."""

from __future__ import annotations

import pytest

from tickrig.host.rtc.engines.ros2.table_reader import parse_table

ODOMETRY = """
[[topic]]
port = "Odometry0.OdometryPosition"
topic = "/odom"
type = "nav_msgs/msg/Odometry"
"""

MISTAKES = """
topics = 1

[[topic]]
port = "Odometry"
topic = "2nd"
type = "nav_msgs/Odometry"
rate = 5

[[topic]]
port = "A0.out"
topic = "a"
type = "std_msgs/msg/Int32"
joints = ["left"]
stop_after = "5 min"
reliable = "yes"

[[topic]]
port = 7
topic = "a"

[[topic]]
port = "B0.out"
topic = "b"
type = "std_msgs/msg/Int32"

[[topic]]
port = "B0.out"
topic = "b"
type = "std_msgs/msg/Int32"

[[topic]]
port = "C0.out"
topic = "b"
type = "std_msgs/msg/Bool"
frame =

[[topic]]
port = "D0.out"
topic = "b"
type = "std_msgs/msg/Bool"

[diagnostics]
topic = "a b"
period = "1ms"
"""


def test_what_a_table_leaves_out_is_as_usual() -> None:
    table = parse_table(ODOMETRY, "robot.toml")
    assert table.entries is not None
    (entry,) = table.entries
    assert (entry.topic, entry.frame, entry.child_frame) == ("odom", "odom", "base_link")
    assert (entry.stop_after_us, entry.reliable) == (0, True)
    assert str(entry) == "robot.toml:2: Odometry0.OdometryPosition"
    assert (table.diagnostics, table.period_us) == ("diagnostics", 1_000_000)


def test_a_velocity_is_taken_back_after_half_a_second_unless_it_is_not_to_be() -> None:
    twist = '[[topic]]\nport = "A0.in"\ntopic = "a"\ntype = "geometry_msgs/msg/Twist"\n'
    first, second = (
        parse_table(f"{twist}{more}", "t").entries or () for more in ("", 'stop_after = "0"')
    )
    assert [entry.stop_after_us for entry in (*first, *second)] == [500_000, 0]


def test_no_diagnostics_are_told_where_their_topic_is_empty() -> None:
    assert parse_table('[diagnostics]\ntopic = ""\n', "t").diagnostics == ""


def test_all_that_is_wrong_is_told_at_once_with_its_line() -> None:
    with pytest.raises(ValueError, match="topics") as refusal:
        parse_table(MISTAKES, "t.toml")
    lines = [line.split(" one of ")[0] for line in str(refusal.value).splitlines()]
    assert lines == [
        "t.toml:2: unknown key 'topics'; known: topic, diagnostics",
        "t.toml:5: port 'Odometry' is not a port, as Odometry0.out",
        "t.toml:6: topic '2nd' is not a topic, as cmd_vel",
        "t.toml:7: type 'nav_msgs/Odometry' is not",
        "t.toml:8: unknown key 'rate'; known: port, topic, type, frame, child_frame, joints,"
        " stop_after, reliable",
        "t.toml:14: std_msgs/msg/Int32 has no joints; it is for sensor_msgs/msg/JointState",
        "t.toml:15: stop_after: '5 min' is not a time: write 1.5s, 200ms or 250us",
        "t.toml:16: reliable 'yes' is not true or false",
        "t.toml:18: type is missing:",
        "t.toml:19: port 7 is not a port, as Odometry0.out",
        "t.toml:27: B0.out has the topic b already, see t.toml:22",
        "t.toml:36: a value is missing before the end of the line",
        "t.toml:36: std_msgs/msg/Bool has no frame; it is for nav_msgs/msg/Odometry,"
        " tf2_msgs/msg/TFMessage, geometry_msgs/msg/PoseStamped, geometry_msgs/msg/TwistStamped,"
        " sensor_msgs/msg/JointState, sensor_msgs/msg/LaserScan",
        "t.toml:38: b has the type std_msgs/msg/Int32 already, see t.toml:27",
        "t.toml:44: topic 'a b' is not a topic, as diagnostics, or empty for none",
        "t.toml:45: period 1ms is not in 10ms..3600s",
    ]


@pytest.mark.parametrize("text", ["topic = 5", "topic = [5]", "diagnostics = 5", "[[diagnostics]]"])
def test_what_is_no_table_is_told_in_a_line(text: str) -> None:
    with pytest.raises(ValueError, match=r"^t:1: [^\n]*$"):
        parse_table(text, "t")
