"""The experiments of the RSi2/NEDO report with emulated bases: A, B1, B2."""

from __future__ import annotations

import runpy
from math import nan
from pathlib import Path

import pytest

from tickrig.emulators.rh3.convoy import Convoy, OmniCart
from tickrig.host.rtc import Manager, OutPort, connect
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import Velocity2D

EXAMPLES = Path(__file__).parents[3] / "examples"
SECOND_US = 1_000_000


def shown(name: str, capsys: pytest.CaptureFixture[str]) -> list[list[float]]:
    """Return the numbers of each line that an example prints, behind its words."""
    runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
    lines = capsys.readouterr().out.replace("|", " ").splitlines()
    return [[float(w) for w in line.split(":")[-1].split()] for line in lines]


def test_robots_follow_a_preceding_one_by_its_position(capsys: pytest.CaptureFixture[str]) -> None:
    *_, last = shown("rh3_follow", capsys)
    leader, first, second, omni = (Pose(*last[at : at + 2]) for at in range(0, 8, 2))
    assert leader.distance(Pose(3, 1)) < 0.04
    for follower, followed in ((first, leader), (second, first), (omni, leader)):
        assert follower.distance(followed) == pytest.approx(0.8, abs=0.05)


def test_the_leader_is_changed_while_they_run(capsys: pytest.CaptureFixture[str]) -> None:
    first, second = (Pose(*numbers) for numbers in shown("rh3_change_leader", capsys))
    assert first.y > 0.5
    assert second.distance(Pose(4, -2)) == pytest.approx(0.8, abs=0.1)


def test_four_robots_obey_one_command(capsys: pytest.CaptureFixture[str]) -> None:
    ends = shown("rh3_four_robots", capsys)
    for number, (x, y, heading) in enumerate(ends):
        assert x == pytest.approx(1.5, abs=0.05)
        assert y == pytest.approx(number, abs=0.05)
        assert heading == pytest.approx(1.5, abs=0.15)


def test_a_leader_that_is_lost_stops_its_follower() -> None:
    convoy = Convoy([Pose(5.0), Pose()])
    convoy.loop.activate()
    convoy.follow(1, leader=0)
    convoy.loop.run_to(4 * SECOND_US)
    convoy.loop.manager.disconnect(convoy.robots[0].position, "Follower1.leader")
    convoy.loop.run_to(7 * SECOND_US)
    stopped = convoy.robots[1].true_pose
    convoy.loop.run_to(9 * SECOND_US)
    assert convoy.robots[1].true_pose == stopped
    assert 0.5 < stopped.x < 2.5


def test_a_cart_waits_before_a_post_until_it_is_taken_away(
    capsys: pytest.CaptureFixture[str],
) -> None:
    runpy.run_path(str(EXAMPLES / "rh3_stop_and_go.py"), run_name="__main__")
    assert capsys.readouterr().out.splitlines() == [
        " 5 s: 1.00 m",
        "10 s: 1.22 m",
        "15 s: 2.52 m",
        "20 s: 3.00 m",
    ]


def test_examples_have_40_lines_at_most() -> None:
    for path in EXAMPLES.glob("rh3_*.py"):
        assert len(path.read_text("utf-8").splitlines()) <= 40, path


class Omni:
    """A robot on omni wheels under commands."""

    def __init__(self) -> None:
        self.manager = Manager()
        self.cart = self.manager.add(OmniCart("OmniCart0"), rate_hz=50.0)
        self.feed = OutPort("to_velocity", iis.TimedVelocity2D)
        connect(self.feed, self.cart.velocity)
        self.manager.activate("OmniCart0")
        self.manager.run_for(20_000)

    def go(self, vx: float, vy: float = 0.0, seconds: float = 1.0) -> Pose:
        for _ in range(round(seconds * 50)):
            self.feed.write(iis.TimedVelocity2D(data=Velocity2D(vx, vy, 0.0)))
            self.manager.run_for(20_000)
        return self.cart.true_pose


def test_a_robot_on_omni_wheels_goes_sideways() -> None:
    pose = Omni().go(0.1, -0.2)
    assert tuple(pose) == pytest.approx((0.095, -0.19, 0.0), abs=3e-3)


def test_silence_stops_a_robot_on_omni_wheels() -> None:
    omni = Omni()
    before = omni.go(0.2)
    omni.manager.run_for(2 * SECOND_US)
    assert 0.1 < omni.cart.true_pose.x - before.x < 0.12
    stopped = omni.cart.true_pose.x
    omni.manager.run_for(SECOND_US)
    assert omni.cart.true_pose.x == pytest.approx(stopped, abs=1e-9)


def test_a_velocity_with_a_number_that_is_none_stops_a_robot_on_omni_wheels() -> None:
    omni = Omni()
    omni.go(0.2)
    assert omni.go(nan).x == pytest.approx(omni.go(nan).x, abs=1e-6)
