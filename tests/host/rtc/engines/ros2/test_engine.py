"""Ports and topics, with a peer that has nothing of ours, over loopback."""

from __future__ import annotations

import logging
import threading
import time
from typing import Any

import pytest

from tests.host.rtc.engines.ros2.extra import CYCLONE
from tests.host.rtc.engines.ros2.joined import Joined, Peer
from tickrig.host.rtc import InPort, ModuleSpec, OutPort, PortStatus, RtComponent
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import (
    Point2D,
    Pose2D,
    RangeData,
    RangerConfig,
    Time,
    TimedDoubleSeq,
    TimedLong,
    Velocity2D,
)

pytestmark = [CYCLONE, pytest.mark.realtime]

TABLE = """
[[topic]]
port = "Robot0.velocity"
topic = "cmd_vel"
type = "geometry_msgs/msg/Twist"
stop_after = "200ms"

[[topic]]
port = "Robot0.pose"
topic = "odom"
type = "nav_msgs/msg/Odometry"

[[topic]]
port = "Robot0.pose"
topic = "tf"
type = "tf2_msgs/msg/TFMessage"

[[topic]]
port = "Robot0.wheels"
topic = "joint_states"
type = "sensor_msgs/msg/JointState"
joints = ["left", "right"]

[[topic]]
port = "Robot0.ranges"
topic = "scan"
type = "sensor_msgs/msg/LaserScan"

[diagnostics]
period = "50ms"
"""


class Robot(RtComponent):
    spec = ModuleSpec("Robot")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.velocity = self.add_port(InPort("velocity", iis.TimedVelocity2D))
        self.pose = self.add_port(OutPort("pose", iis.TimedPose2D))
        self.wheels = self.add_port(OutPort("wheels", TimedDoubleSeq))
        self.ranges = self.add_port(OutPort("ranges", RangeData))


def robot(joined: Joined, table: str = TABLE) -> tuple[Robot, Peer]:
    robot = joined.manager.add(Robot("Robot0"))
    joined.join(table)
    return robot, joined.peer()


def speeds(robot: Robot) -> list[Velocity2D]:
    found = []
    while robot.velocity.is_new and (value := robot.velocity.read()) is not None:
        found.append(value.data)
    return found


def arrived(joined: Joined, robot: Robot, peer: Peer, line: str) -> list[Velocity2D]:
    """Write again and again until something arrives."""
    found: list[Velocity2D] = []

    def done() -> bool:
        peer.say(line)
        found.extend(speeds(robot))
        return bool(found)

    joined.until(done)
    return found


def test_a_twist_becomes_a_velocity(joined: Joined) -> None:
    driven, peer = robot(joined)
    found = arrived(joined, driven, peer, "write cmd_vel Twist 0.25 0.125 9 9 9 -0.5")
    assert found[0] == Velocity2D(0.25, 0.125, -0.5)


def test_a_robot_whose_driver_is_silent_stands_still(joined: Joined) -> None:
    driven, peer = robot(joined)
    found = arrived(joined, driven, peer, "write cmd_vel Twist 0.25 0 0 0 0 0")

    def stands() -> bool:
        found.extend(speeds(driven))
        return found[-1] == Velocity2D()

    joined.until(stands)


def test_poses_joints_and_ranges_arrive_as_messages(joined: Joined) -> None:
    driven, peer = robot(joined)
    for topic, kind in {
        "odom": "Odometry",
        "tf": "TFMessage",
        "joint_states": "JointState",
        "scan": "LaserScan",
        "diagnostics": "DiagnosticArray",
    }.items():
        peer.say(f"read {topic} {kind}")
    config = RangerConfig(-0.5, 0.5, 0.5, 0.02, 4.0, 0.001, 10.0)

    def write() -> bool:
        tm = Time.from_us(joined.manager.now_us)
        driven.pose.write(iis.TimedPose2D(tm, data=Pose2D(Point2D(1.0, 2.0), 0.0)))
        driven.wheels.write(TimedDoubleSeq(tm, (0.5, -0.5)))
        driven.ranges.write(RangeData(tm, (1.0, 0.0, 2.5), config=config))
        return all(peer.heard(topic) for topic in ("odom", "tf", "joint_states", "scan"))

    joined.until(write)
    odometry: dict[str, Any] = peer.heard("odom")[-1]
    assert odometry["child_frame_id"] == "base_link"
    assert odometry["pose"]["pose"]["position"] == {"x": 1.0, "y": 2.0, "z": 0.0}
    assert odometry["pose"]["pose"]["orientation"] == {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    (transform,) = peer.heard("tf")[-1]["transforms"]
    assert transform["header"]["frame_id"] == "odom"
    assert transform["transform"]["translation"] == {"x": 1.0, "y": 2.0, "z": 0.0}
    joints = peer.heard("joint_states")[-1]
    assert dict(zip(joints["name"], joints["position"], strict=True)) == {
        "left": 0.5,
        "right": -0.5,
    }
    scan = peer.heard("scan")[-1]
    assert scan["ranges"] == [1.0, float("inf"), 2.5]
    assert (scan["angle_min"], scan["angle_max"], scan["range_max"]) == (-0.5, 0.5, 4.0)
    joined.until(lambda: len(peer.heard("diagnostics")) >= 4)
    stamps = [str(array["header"]["stamp"]) for array in peer.heard("diagnostics")]
    assert len(set(stamps)) == len(stamps)  # each is sent once
    (status,) = peer.heard("diagnostics")[-1]["status"]
    assert (status["name"], status["message"], status["level"]) == ("Robot0", "Inactive", 1)


def test_without_a_table_all_ports_have_topics(joined: Joined) -> None:
    source: Any = joined.manager.create("ConsoleIn")
    sink: Any = joined.manager.create("ConsoleOut")
    joined.manager.activate("ConsoleIn0", "ConsoleOut0")
    joined.join()
    peer = joined.peer()
    peer.say("read ConsoleIn0/out Int32")

    def there_and_back() -> bool:
        source.enter(-5)
        peer.say("write ConsoleOut0/in Int32 2147483647")
        return bool(peer.heard("ConsoleIn0/out")) and bool(sink.received)

    joined.until(there_and_back)
    assert peer.heard("ConsoleIn0/out")[-1] == {"data": -5}
    assert sink.received[-1].data == 2_147_483_647


def test_a_component_that_comes_later_is_joined_and_one_that_goes_is_not(joined: Joined) -> None:
    joined.join(TABLE)
    peer = joined.peer()
    driven = joined.manager.add(Robot("Robot0"))
    arrived(joined, driven, peer, "write cmd_vel Twist 1 0 0 0 0 0")
    joined.manager.delete("Robot0")
    assert not driven.velocity.connectors
    again = joined.manager.add(Robot("Robot0"))
    arrived(joined, again, peer, "write cmd_vel Twist 1 0 0 0 0 0")


@pytest.mark.parametrize("end", ["end", "kill"])
def test_a_peer_that_goes_and_comes_back_is_found_again(
    joined: Joined, caplog: pytest.LogCaptureFixture, end: str
) -> None:
    driven, peer = robot(joined)
    arrived(joined, driven, peer, "write cmd_vel Twist 1 0 0 0 0 0")
    getattr(peer, end)()
    arrived(joined, driven, joined.peer(), "write cmd_vel Twist 2 0 0 0 0 0")
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


def test_a_peer_finds_us_again_when_we_were_away(joined: Joined) -> None:
    driven, peer = robot(joined)
    arrived(joined, driven, peer, "write cmd_vel Twist 1 0 0 0 0 0")
    joined.leave()
    assert not driven.velocity.connectors
    joined.join(TABLE)
    arrived(joined, driven, peer, "write cmd_vel Twist 2 0 0 0 0 0")


def test_a_peer_with_another_type_is_told_in_a_line(
    joined: Joined, caplog: pytest.LogCaptureFixture
) -> None:
    _, peer = robot(joined)
    peer.say("offer cmd_vel Int32")
    peer.say("read odom Twist")
    joined.until(lambda: len(caplog.messages) == 2)
    assert sorted(caplog.messages) == [
        "ros2: a peer reads geometry_msgs/msg/Twist on odom, not nav_msgs/msg/Odometry;"
        " it is not joined",
        "ros2: a peer writes std_msgs/msg/Int32 on cmd_vel, not geometry_msgs/msg/Twist;"
        " it is not joined",
    ]


def test_a_peer_that_does_not_send_reliably_is_told_in_a_line(
    joined: Joined, caplog: pytest.LogCaptureFixture
) -> None:
    driven, peer = robot(joined)
    peer.say("best_effort")
    peer.say("offer cmd_vel Twist")
    joined.until(lambda: caplog.messages)
    (line,) = caplog.messages
    assert line == (
        "ros2: a writer of cmd_vel does not send reliably: set reliable = false; it is not joined"
    )
    joined.leave()
    joined.join(TABLE.replace('stop_after = "200ms"', "reliable = false"))
    arrived(joined, driven, peer, "write cmd_vel Twist 2 0 0 0 0 0")


@pytest.mark.parametrize(
    ("policy", "said"),
    [
        ("Deadline(50_000_000)", "deadline 50 ms"),
        ("Liveliness.Automatic(100_000_000)", "liveliness automatic, lease 100 ms"),
        ("Liveliness.ManualByTopic(100_000_000)", "liveliness manual by topic"),
        ("Ownership.Exclusive", "ownership exclusive"),
        ("DestinationOrder.BySourceTimestamp", "destination order by source timestamp"),
    ],
)
def test_a_reader_whose_policy_cannot_be_met_is_told_by_its_name(
    joined: Joined, caplog: pytest.LogCaptureFixture, policy: str, said: str
) -> None:
    _, peer = robot(joined)
    peer.say(f"policy {policy}")
    peer.say("read odom Odometry")
    joined.until(lambda: caplog.messages)
    (line,) = caplog.messages
    assert line == (
        f"ros2: a reader of odom has a QoS policy that does not fit ours: {said}; it is not joined"
    )


@pytest.mark.parametrize(
    ("number", "said"), [("nan", "nan"), ("-inf", "-inf"), ("5e-324", "4.94066e-324")]
)
def test_a_number_that_no_sender_means_is_told_once(
    joined: Joined, caplog: pytest.LogCaptureFixture, number: str, said: str
) -> None:
    driven, peer = robot(joined)
    for _ in range(3):
        arrived(joined, driven, peer, f"write cmd_vel Twist {number} 0 0 0 0 0")
    (line,) = caplog.messages
    assert f"linear.x is {said} on cmd_vel" in line
    assert "ROS_PYTHON_CHECK_FIELDS=1" in line


def test_a_stopped_peer_delays_nobody(joined: Joined) -> None:
    driven, stopped = robot(joined)
    awake = joined.peer()
    for peer in (stopped, awake):
        peer.say("read odom Odometry")

    def write() -> bool:
        tm = Time.from_us(joined.manager.now_us)
        return driven.pose.write(iis.TimedPose2D(tm, data=Pose2D())) is PortStatus.PORT_OK

    joined.until(lambda: write() and (stopped.heard("odom") and awake.heard("odom")))
    stopped.pause()
    try:
        before = len(awake.heard("odom"))
        for _ in range(200):
            write()
            joined.step()
        joined.until(lambda: write() and len(awake.heard("odom")) > before + 200)
    finally:
        stopped.go_on()
    before = len(stopped.heard("odom"))
    joined.until(lambda: write() and len(stopped.heard("odom")) > before)


def test_a_number_that_is_no_message_is_told_once(
    joined: Joined, caplog: pytest.LogCaptureFixture
) -> None:
    source: Any = joined.manager.create("ConsoleIn")
    joined.join()
    peer = joined.peer()
    peer.say("read ConsoleIn0/out Int32")
    for number in (2**40, 2**41):
        source.out.write(TimedLong(data=number))
    joined.until(lambda: source.out.write(TimedLong(data=7)) or peer.heard("ConsoleIn0/out"))
    assert peer.heard("ConsoleIn0/out")[-1] == {"data": 7}
    (line,) = caplog.messages
    assert line.startswith("ConsoleIn0.out: no std_msgs/msg/Int32: ")


def test_what_calls_itself_a_twist_and_is_none_hurts_nobody(
    joined: Joined, caplog: pytest.LogCaptureFixture
) -> None:
    driven, peer = robot(joined)
    liar = joined.peer()
    liar.say("offer cmd_vel WrongTwist")
    joined.until(lambda: caplog.messages)
    liar.say("write cmd_vel WrongTwist ahead")
    found = arrived(joined, driven, peer, "write cmd_vel Twist 0.25 0 0 0 0 0")
    assert found[0] == Velocity2D(0.25, 0, 0)
    assert caplog.messages == [
        "ros2: a peer writes geometry_msgs/msg/Twist with other fields on cmd_vel; it is not joined"
    ]


def test_bytes_that_are_no_twist_are_told_once(
    joined: Joined, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tickrig.host.rtc.engines.ros2 import participant  # noqa: PLC0415 - an extra

    careless = participant._CONFIGURATION.replace("1.15", "1.16")
    monkeypatch.setattr(participant, "_CONFIGURATION", careless)
    driven, peer = robot(joined)
    liar = joined.peer("careless")

    def lies() -> list[str]:
        liar.say("write cmd_vel WrongTwist ahead")
        return caplog.messages

    joined.until(lies)
    for _ in range(20):
        lies()
    found = arrived(joined, driven, peer, "write cmd_vel Twist 0.25 0 0 0 0 0")
    assert found[0] == Velocity2D(0.25, 0, 0)
    (line,) = caplog.messages
    assert "deserialization rt/cmd_vel/geometry_msgs::msg::dds_::Twist_ failed" in line


def test_no_peer_that_is_joined_is_said_not_to_be(
    joined: Joined, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tickrig.host.rtc.engines.ros2.participant.MATCH_S", 0.5)
    _, first = robot(joined)
    peers = [first, *(joined.peer() for _ in range(3))]
    for peer in peers:
        peer.say("offer cmd_vel Twist")
        peer.say("read odom Odometry")
    end_s = time.monotonic() + 3.0
    while time.monotonic() < end_s:
        joined.step()
    assert caplog.messages == []


def test_dds_is_called_in_threads_of_the_engine_alone(
    joined: Joined, monkeypatch: pytest.MonkeyPatch
) -> None:
    from cyclonedds import pub, sub  # noqa: PLC0415 - an extra

    callers = set[str]()

    def spied(function: Any) -> Any:
        def call(*words: Any, **options: Any) -> Any:
            callers.add(threading.current_thread().name)
            return function(*words, **options)

        return call

    for kind, name in ((pub.DataWriter, "write"), (sub.DataReader, "take")):
        monkeypatch.setattr(kind, name, spied(getattr(kind, name)))
        monkeypatch.setattr(kind, "__init__", spied(kind.__init__))
    driven, peer = robot(joined)
    peer.say("read odom Odometry")

    def write() -> list[Any]:
        tm = Time.from_us(joined.manager.now_us)
        driven.pose.write(iis.TimedPose2D(tm, data=Pose2D()))
        return peer.heard("odom")

    joined.until(write)
    arrived(joined, driven, peer, "write cmd_vel Twist 0.25 0 0 0 0 0")
    joined.manager.delete("Robot0")
    joined.manager.add(Robot("Robot0"))
    assert callers == {"ros2 in", "ros2 out"}
