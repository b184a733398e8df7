"""The components between range finder and base, each alone."""

from __future__ import annotations

from math import nan, pi

import pytest

from tests.host.rtc.motion.port_bench import PERIOD_US, PortBench
from tickrig.host.rtc import Provider, ServicePort, connect
from tickrig.host.rtc.motion.options.obstacles import (
    CollisionDetection,
    ObstacleMonitor,
    ObstaclesAvoidance,
    UrgToObstacles,
)
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import (
    Point2D,
    Pose2D,
    RangeData,
    RangerConfig,
    TimedDouble,
    Velocity2D,
)


def scan(*ranges: float) -> RangeData:
    """Return ranges to the right, ahead and to the left."""
    return RangeData(ranges=ranges, config=RangerConfig(minAngle=-pi / 2, angularRes=pi / 2))


def points(*places: tuple[float, float]) -> iis.TimedPose2DSeq:
    return iis.TimedPose2DSeq(data=tuple(Pose2D(Point2D(x, y)) for x, y in places))


def far(distance: float) -> TimedDouble:
    return TimedDouble(data=distance)


def test_ranges_become_points_in_the_frame_of_the_robot() -> None:
    on = PortBench(UrgToObstacles("U0"), sensor_x="0.5")
    (seen,) = on.after("obstacles", "ranges", scan(1.0, 2.0, 3.0))
    assert [(round(p.position.x, 6), p.position.y) for p in seen.data] == [
        (0.5, -1.0),
        (2.5, 0.0),
        (0.5, 3.0),
    ]


def test_what_is_no_range_is_no_point() -> None:
    (seen,) = PortBench(UrgToObstacles("U0")).after("obstacles", "ranges", scan(0.0, nan, -1.0))
    assert seen.data == ()
    strange = RangeData(ranges=(1.0,), config=RangerConfig(minAngle=nan))
    (seen,) = PortBench(UrgToObstacles("U0")).after("obstacles", "ranges", strange)
    assert seen.data == ()


@pytest.mark.parametrize(
    ("places", "distance"),
    [
        (((1.0, 0.0), (2.0, 0.0)), 0.75),
        (((1.0, 0.36), (2.0, -0.35)), 1.75),
        (((-1.0, 0.0),), 5.0),
        ((), 5.0),
        (((0.1, 0.0),), 0.0),
        (((9.0, 0.0),), 5.0),
    ],
)
def test_the_nearest_thing_in_the_lane_counts(
    places: tuple[tuple[float, float], ...], distance: float
) -> None:
    on = PortBench(ObstacleMonitor("O0"))
    (told,) = on.after("distance", "obstacles", points(*places))
    assert told.data == pytest.approx(distance)


def test_without_a_scan_nothing_is_told() -> None:
    on = PortBench(ObstacleMonitor("O0"))
    on.period(3)
    assert on.taken("distance") == []


class Avoiding(PortBench[ObstaclesAvoidance]):
    """The component, with a velocity in each period."""

    def __init__(self) -> None:
        super().__init__(ObstaclesAvoidance("A0"))

    def drive(
        self, distance: float | None, v: float = 0.3, w: float = 0.0, periods: int = 100
    ) -> list[Velocity2D]:
        self.taken("OutTargetVelocity")
        for _ in range(periods):
            if distance is not None:
                self.feed("distance", far(distance))
            self.feed("InTargetVelocity", iis.TimedVelocity2D(data=Velocity2D(v, 0.0, w)))
            self.period()
        return [value.data for value in self.taken("OutTargetVelocity")]


def test_on_a_free_way_velocities_pass() -> None:
    on = Avoiding()
    speeds = [data.vx for data in on.drive(5.0, periods=60)]
    assert speeds[0] == pytest.approx(0.3 * PERIOD_US / 1e6)
    assert speeds[-1] == 0.3


def test_something_in_the_way_stops_it_on_a_ramp() -> None:
    on = Avoiding()
    on.drive(5.0, periods=60)
    speeds = [data.vx for data in on.drive(0.5, periods=60)]
    assert speeds[:2] == pytest.approx([0.294, 0.288])
    assert speeds[-1] == 0.0


def test_it_goes_on_when_the_way_is_free_with_some_room() -> None:
    on = Avoiding()
    on.drive(5.0, periods=60)
    on.drive(0.4, periods=60)
    assert on.drive(0.6, periods=60)[-1].vx == 0.0
    assert on.drive(0.71, periods=60)[-1].vx == 0.3
    assert on.drive(0.6, periods=60)[-1].vx == 0.3


def test_turning_and_going_back_always_pass() -> None:
    on = Avoiding()
    assert on.drive(0.1, 0.0, 0.3)[-1] == Velocity2D(0.0, 0.0, 0.3)
    assert on.drive(0.1, -0.1, 0.0)[-1] == Velocity2D(-0.1, 0.0, 0.0)
    assert on.drive(0.1, 0.3, 0.3)[-1] == Velocity2D()


def test_without_eyes_it_stands() -> None:
    on = Avoiding()
    assert on.drive(None)[-1].vx == 0.0
    on.drive(5.0)
    assert on.drive(None)[-1].vx == 0.0
    assert on.drive(nan)[-1].vx == 0.0


def test_without_a_velocity_it_says_nothing() -> None:
    on = Avoiding()
    on.drive(5.0)
    on.period(5)
    assert on.taken("OutTargetVelocity") == []


def test_a_velocity_with_a_number_that_is_none_is_0() -> None:
    on = Avoiding()
    assert on.drive(5.0, nan)[-1] == Velocity2D()


class Bumped:
    """What RefHardRh3 is told."""

    def __init__(self) -> None:
        self.told: list[str] = []

    def Stop(self) -> None:  # noqa: N802 - as in the IDL
        self.told.append("Stop")

    def Go(self) -> None:  # noqa: N802
        self.told.append("Go")


def detecting() -> tuple[PortBench[CollisionDetection], Bumped]:
    bumped, port = Bumped(), ServicePort("BumpRefHard")
    port.provide(Provider("service", "RefHard", bumped))
    component = CollisionDetection("C0")
    connect(component.ports["BumpRefHard"], port)
    return PortBench(component), bumped


def test_it_calls_stop_and_go_once_each() -> None:
    on, bumped = detecting()
    assert bumped.told == ["Stop"]
    for distance in (1.0, 1.0, 0.14, 0.2, 0.3, 0.2):
        on.feed("distance", far(distance))
        on.period()
    assert bumped.told == ["Stop", "Go", "Stop", "Go"]


def test_it_calls_stop_when_nobody_looks() -> None:
    on, bumped = detecting()
    on.feed("distance", far(1.0))
    on.period(20)
    assert bumped.told == ["Stop", "Go"]
    on.period(10)
    assert bumped.told == ["Stop", "Go", "Stop"]


def test_deactivated_it_lets_the_base_run() -> None:
    on, bumped = detecting()
    on.deactivate()
    assert bumped.told == ["Stop", "Go"]


def test_free_and_deactivated_it_says_nothing() -> None:
    on, bumped = detecting()
    on.feed("distance", far(1.0))
    on.period()
    on.deactivate()
    assert bumped.told == ["Stop", "Go"]


def test_without_a_base_it_only_looks() -> None:
    on = PortBench(CollisionDetection("C0"))
    on.feed("distance", far(0.0))
    on.period(3)
    assert on.state == "ACTIVE"
