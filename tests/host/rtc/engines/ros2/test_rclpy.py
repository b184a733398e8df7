"""A node of rclpy drives the emulated cart, and gets all that it tells (`.ci/ros2`)."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path

import pytest

from tests.host.rtc.engines.ros2.joined import CHAIN, DEADLINE_S, Peer, command, own_domain

PYTHON = os.environ.get("ROS2_PYTHON", "")
NODE = Path(__file__).with_name("rclpy_node.py")
DRIVER = Path(__file__).parents[5] / "examples" / "ros2_drive.py"

pytestmark = [
    pytest.mark.skipif(not PYTHON, reason="ROS2_PYTHON names no Python with rclpy: see .ci/ros2"),
    pytest.mark.realtime,
]

READ = {
    "odom": "nav_msgs/msg/Odometry",
    "joint_states": "sensor_msgs/msg/JointState",
    "scan": "sensor_msgs/msg/LaserScan",
    "diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
}


def environment(domain: int) -> dict[str, str]:
    return {
        **os.environ,
        "ROS_DOMAIN_ID": str(domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
    }


def node(domain: int) -> Peer:
    return Peer(domain, [PYTHON, str(NODE)], environment(domain))


def test_a_node_drives_the_cart_until_it_is_gone() -> None:
    with own_domain() as domain:
        words = ("serve", "--ros2", "--ros2-domain", str(domain), "--room", "6", "4")
        with command("rh3", *words):
            driver, watcher = node(domain), node(domain)
            try:
                for topic, kind in READ.items():
                    watcher.say(f"read {topic} {kind}")
                end_s = time.monotonic() + DEADLINE_S
                while not all(map(watcher.heard, READ)) or _ahead_m(watcher) < 0.1:
                    assert time.monotonic() < end_s
                    driver.say("write cmd_vel geometry_msgs/msg/Twist 0.2 0")
                    watcher.heard("odom", 0.05)
                driver.kill()
                while _speed(watcher) > 0.001:
                    assert time.monotonic() < end_s
                    watcher.heard("odom", 0.05)
                assert watcher.heard("joint_states")[-1]["name"] == ["left_wheel", "right_wheel"]
                assert min(watcher.heard("scan")[-1]["ranges"]) == pytest.approx(2.0, abs=0.1)
                statuses = watcher.heard("diagnostics")[-1]["status"]
                assert {each["name"]: each["level"] for each in statuses}["Odometry0"] == 0
            finally:
                driver.end()
                watcher.end()


def test_the_driver_of_the_page_drives_the_cart() -> None:
    with own_domain() as domain, command("rh3", "serve", "--ros2", "--ros2-domain", str(domain)):
        done = subprocess.run(
            [PYTHON, str(DRIVER), "0.3"],
            env=environment(domain),
            capture_output=True,
            text=True,
            timeout=2 * DEADLINE_S,
            check=True,
        )
    assert float(done.stdout.split()[1]) >= 0.3


def test_a_node_and_a_system_pass_numbers_both_ways(tmp_path: Path) -> None:
    (tmp_path / "chain.toml").write_text(CHAIN, "utf-8")
    words = ("rtc", "run", str(tmp_path / "chain.toml"), "--control", str(tmp_path / "ctl"))
    options = ("--console", "--ros2", "--ros2-domain")
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with own_domain() as domain, command("tickrig", *words, *options, str(domain), **pipes) as run:
        judge = node(domain)
        try:
            judge.say("read ConsoleIn0/out std_msgs/msg/Int32")
            end_s = time.monotonic() + DEADLINE_S
            assert run.stdin is not None
            assert run.stdout is not None
            os.set_blocking(run.stdout.fileno(), False)
            shown: bytes | None = None
            while not (judge.heard("ConsoleIn0/out", 0.05) and shown):
                assert time.monotonic() < end_s
                run.stdin.write(b"2147483647\n")
                judge.say("write ConsoleOut0/in std_msgs/msg/Int32 -5")
                shown = shown or run.stdout.read()
            assert judge.heard("ConsoleIn0/out")[0] == {"data": 2_147_483_647}
            assert shown.startswith(b"ConsoleOut0 -5\n")
        finally:
            judge.end()


def _ahead_m(peer: Peer) -> float:
    found = peer.heard("odom")
    return float(found[-1]["pose"]["pose"]["position"]["x"]) if found else 0.0


def _speed(peer: Peer) -> float:
    return abs(float(peer.heard("odom")[-1]["twist"]["twist"]["linear"]["x"]))
