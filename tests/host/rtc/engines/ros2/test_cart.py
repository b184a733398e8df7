"""`rh3 serve --ros2`: a peer in another process drives the emulated cart."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from tests.host.rtc.engines.ros2.extra import CYCLONE
from tests.host.rtc.engines.ros2.joined import DEADLINE_S, Peer, command, own_domain
from tickrig.emulators.rh3.commands.motion_cli import main
from tickrig.host.control.client import ControlClient

READ = {
    "odom": "Odometry",
    "tf": "TFMessage",
    "joint_states": "JointState",
    "scan": "LaserScan",
    "diagnostics": "DiagnosticArray",
}


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ("--ros2 --pace 10", "--pace is not for --ros2: what others send has real time"),
        ("--ros2 --device x --room 4 4", "--room is for the emulated base"),
        ("--ros2-table x", "--ros2-table is for --ros2"),
    ],
)
def test_what_a_cart_cannot_be_is_refused_in_a_line(words: str, error: str) -> None:
    result = CliRunner().invoke(main, ["serve", *words.split()])
    assert result.exit_code == 2
    assert result.stderr.startswith(f"Error: {error}")
    assert len(result.stderr.splitlines()) == 1


@CYCLONE
@pytest.mark.realtime
def test_a_peer_drives_the_cart_and_it_stands_when_the_peer_is_gone() -> None:
    with own_domain() as domain:
        words = ["serve", "--ros2", "--ros2-domain", str(domain), "--room", "6", "4"]
        with command("rh3", *words):
            driver, watcher = Peer(domain), Peer(domain)
            try:
                for topic, kind in READ.items():
                    watcher.say(f"read {topic} {kind}")
                end_s = time.monotonic() + DEADLINE_S
                while _ahead_m(watcher) < 0.1:
                    assert time.monotonic() < end_s
                    driver.say("write cmd_vel Twist 0.2 0 0 0 0 0")
                    watcher.heard("odom", 0.05)
                driver.kill()
                while _speed(watcher) > 0.001:
                    assert time.monotonic() < end_s
                    watcher.heard("odom", 0.05)
                joints = watcher.heard("joint_states")[-1]
                assert joints["name"] == ["left_wheel", "right_wheel"]
                assert joints["position"][0] == pytest.approx(joints["position"][1], abs=0.1)
                scan: dict[str, Any] = watcher.heard("scan")[-1]
                assert min(scan["ranges"]) == pytest.approx(2.0, abs=0.1)
                (transform,) = watcher.heard("tf")[-1]["transforms"]
                assert transform["transform"]["translation"]["x"] > 0.1
                moved = {_stamp(each["transforms"][0]) for each in watcher.heard("tf")}
                posed = {_stamp(each) for each in watcher.heard("odom")}
                assert len(moved & posed) > 10
                assert abs(max(moved)[0] - time.time()) < DEADLINE_S
                levels = {each["name"]: each["level"] for each in _statuses(watcher)}
                assert levels["Odometry0"] == 0
            finally:
                driver.end()
                watcher.end()


@CYCLONE
@pytest.mark.realtime
def test_a_command_of_the_console_drives_a_cart_that_peers_may_drive(tmp_path: Path) -> None:
    control = tmp_path / "cart"
    with own_domain() as domain:
        words = ["serve", "--ros2", "--ros2-domain", str(domain), "--control", str(control)]
        with command("rh3", *words):
            peer = Peer(domain)
            try:
                peer.say("read odom Odometry")
                end_s = time.monotonic() + DEADLINE_S
                while not control.exists():
                    assert time.monotonic() < end_s
                    peer.heard("odom", 0.05)
                with ControlClient(control) as cart:
                    cart.request("goal", pose=[0.2, 0, 0])
                    while cart.request("status")["finished"] != 1:
                        assert time.monotonic() < end_s
                        peer.heard("odom", 0.05)
                while _ahead_m(peer) < 0.3:  # the command has finished: the peer drives
                    assert time.monotonic() < end_s
                    peer.say("write cmd_vel Twist 0.2 0 0 0 0 0")
                    peer.heard("odom", 0.05)
            finally:
                peer.end()


def _stamp(message: dict[str, Any]) -> tuple[int, int]:
    stamp = message["header"]["stamp"]
    return stamp["sec"], stamp["nanosec"]


def _ahead_m(peer: Peer) -> float:
    found = peer.heard("odom")
    return float(found[-1]["pose"]["pose"]["position"]["x"]) if found else 0.0


def _speed(peer: Peer) -> float:
    twist = peer.heard("odom")[-1]["twist"]["twist"]
    return math.hypot(twist["linear"]["x"], twist["angular"]["z"])


def _statuses(peer: Peer) -> list[dict[str, Any]]:
    return list(peer.heard("diagnostics")[-1]["status"])
