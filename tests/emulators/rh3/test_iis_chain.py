"""The common interfaces in front of the chain, closed loop in virtual time."""

from __future__ import annotations

from math import pi
from typing import Any

import pytest

from tickrig.emulators.rh3.closed_loop import ClosedLoop
from tickrig.host.rtc import InPort, OutPort, connect
from tickrig.host.rtc.motion.geometry import Pose
from tickrig.host.rtc.motion.iis_interfaces import (
    PASSED,
    STOPPED,
    GoalInterface,
    PathInterface,
    RunningInformation,
)
from tickrig.host.rtc.motion.ports import read_all, to_pose_2d
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.rtc import Velocity2D

SECOND_US = 1_000_000
WIDE = {"dataport.buffer.length": "64"}


class IisCart:
    """A cart with the interfaces in front of it."""

    def __init__(self) -> None:
        self.loop = ClosedLoop()
        manager, context = self.loop.manager, self.loop.chain.context
        manager.add(GoalInterface("Goal0"), context=context)
        manager.add(PathInterface("Path0"), context=context)
        manager.add(RunningInformation("Info0"), rate_hz=100.0)
        for first, second in (
            ("Goal0.position", "OmniTo2WD0.goal"),
            ("Goal0.min_path", "Navigation0.min_path"),
            ("Path0.target_path", "PathFollower0.target_path"),
            ("Odometry0.OdometryPosition", "Path0.position"),
            ("Odometry0.OdometryPosition", "Info0.position"),
        ):
            manager.connect(first, second, WIDE)
        self.loop.activate("tuned")
        manager.activate("Goal0", "Path0", "Info0")
        self.loop.run_to(SECOND_US // 2)

    def run(self, seconds: float) -> Pose:
        self.loop.run_to(self.loop.now_us + round(seconds * SECOND_US))
        return self.loop.pose

    def feed(self, name: str, value: Struct) -> None:
        out = OutPort("to", type(value))
        end = connect(out, self.loop.manager.port(name))
        out.write(value)
        self.run(0.02)
        end.end()

    def listen(self, name: str, kind: type[Any]) -> InPort[Any]:
        port = InPort("from", kind)
        connect(self.loop.manager.port(name), port, WIDE)
        return port


def goals(*poses: Pose) -> iis.TimedPose2DSeq:
    return iis.TimedPose2DSeq(data=tuple(map(to_pose_2d, poses)))


def path(*poses: Pose) -> iis.TimedPath2DSeq:
    return iis.TimedPath2DSeq(pose=tuple(map(to_pose_2d, poses)))


def test_the_first_goal_is_driven_to() -> None:
    cart = IisCart()
    cart.feed("Goal0.goal", goals(Pose(0.5, 0.0, 1.75 * pi), Pose(9, 9)))
    end = cart.run(8)
    assert end.distance(Pose(0.5)) < 0.005
    assert end.heading == pytest.approx(-pi / 4, abs=0.01)


def test_a_cleared_goal_stops_the_cart() -> None:
    cart = IisCart()
    cart.feed("Goal0.goal", goals(Pose(3.0)))
    cart.run(3)
    cart.feed("Goal0.goal", goals())
    stopped = cart.run(2)
    assert 0.3 < stopped.x < 1.2
    assert cart.run(2) == stopped


def test_a_path_is_driven_and_each_way_point_told() -> None:
    cart = IisCart()
    states = cart.listen("Path0.running_state", iis.TimedPose2D)
    cart.feed("Path0.path", path(Pose(), Pose(0.6), Pose(0.6, 0.5, pi / 2)))
    end = cart.run(14)
    assert end.distance(Pose(0.6, 0.5)) < 0.005
    told = [
        (state.id[0], state.data.position.x, state.data.position.y) for state in read_all(states)
    ]
    assert told == [(PASSED, 0, 0), (PASSED, 0.6, 0), (PASSED, 0.6, 0.5), (STOPPED, 0.6, 0.5)]


def test_a_new_path_replaces_the_old_one_while_it_is_driven() -> None:
    cart = IisCart()
    cart.feed("Path0.path", path(Pose(), Pose(3.0)))
    cart.run(2)
    cart.feed("Path0.path", path(Pose(), Pose(1.0, 0.0)))
    assert cart.run(8).distance(Pose(1.0)) < 0.005


def test_a_cart_backs_up_where_the_speed_is_negative() -> None:
    cart = IisCart()
    velocities = cart.listen("Info0.velocity", iis.TimedVelocity2D)
    back = iis.TimedPath2DSeq(
        pose=path(Pose(), Pose(-0.5)).pose, velocity=(Velocity2D(), Velocity2D(vx=-0.2))
    )
    cart.feed("Path0.path", back)
    cart.run(2)
    assert list(read_all(velocities))[-1].data.vx == pytest.approx(-0.2, abs=0.01)
    end = cart.run(4)
    assert end.distance(Pose(-0.5)) < 0.005
    assert abs(end.heading) < 0.01


def test_running_information_is_told_every_10_ms() -> None:
    cart = IisCart()
    cart.feed("Goal0.goal", goals(Pose(3.0)))
    cart.run(4)
    velocities = cart.listen("Info0.velocity", iis.TimedVelocity2D)
    cart.run(0.5)
    told = list(read_all(velocities))
    assert len(told) == 50
    assert told[-1].data.vx == pytest.approx(0.3, abs=0.01)
