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
    assert str(refusal.value).splitlines() == [
        "t.toml:2: no key 'topics'; did you mean 'topic'?",
        "t.toml:5: topic[1].port: it takes a port, as Odometry0.out, not 'Odometry'",
        "t.toml:6: topic[1].topic: it takes a topic, as cmd_vel, not '2nd'",
        "t.toml:7: topic[1].type: 'nav_msgs/Odometry' is no known message; did you mean"
        " 'nav_msgs/msg/Odometry'?",
        "t.toml:8: topic[1]: no key 'rate'; did you mean 'frame'?",
        "t.toml:14: topic[2].joints: std_msgs/msg/Int32 has no joints; it is for"
        " sensor_msgs/msg/JointState",
        "t.toml:15: topic[2].stop_after: '5 min' is not a time: write 1.5s, 200ms or 250us",
        "t.toml:16: topic[2].reliable: it takes true or false, not 'yes'",
        "t.toml:18: topic[3]: no key 'type': of its values, a message, as std_msgs/msg/Int32",
        "t.toml:19: topic[3].port: it takes a port, as Odometry0.out, not 7",
        "t.toml:27: B0.out has the topic b already, see t.toml:22",
        "t.toml:36: a value is missing before the end of the line",
        "t.toml:36: topic[6].frame: std_msgs/msg/Bool has no frame; it is for"
        " nav_msgs/msg/Odometry, tf2_msgs/msg/TFMessage, geometry_msgs/msg/PoseStamped,"
        " geometry_msgs/msg/TwistStamped, sensor_msgs/msg/JointState, sensor_msgs/msg/LaserScan",
        "t.toml:38: b has the type std_msgs/msg/Int32 already, see t.toml:27",
        "t.toml:44: diagnostics.topic: it takes a topic, as diagnostics, or empty for none,"
        " not 'a b'",
        "t.toml:45: diagnostics.period: it takes 10ms..3600s, not '1ms'",
    ]


@pytest.mark.parametrize("text", ["topic = 5", "topic = [5]", "diagnostics = 5", "[[diagnostics]]"])
def test_what_is_no_table_is_told_in_a_line(text: str) -> None:
    with pytest.raises(ValueError, match=r"^t:1: [^\n]*$"):
        parse_table(text, "t")
