from __future__ import annotations

from collections.abc import Callable
from math import inf, nan, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.rtc.motion.port_bench import PortBench, at
from tickrig.host.rtc import RtComponent
from tickrig.host.rtc.motion.geometry import wrap
from tickrig.host.rtc.motion.iis_interfaces import (
    Position2To3,
    Position3To2,
    PositiveHeading,
    Velocity1To2,
    Velocity2To1,
    Velocity2To3,
    Velocity3To2,
    WrappedHeading,
)
from tickrig.wire.rtc_types import iis, rtc
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.rtc import Time, Velocity2D

TM = Time(1, 2_000)
numbers = st.floats(-1e6, 1e6)


@pytest.mark.parametrize(
    ("kind", "value", "expected"),
    [
        (
            Velocity1To2,
            rtc.TimedVelocity(TM, 0.5, -0.1),
            iis.TimedVelocity(TM, (), 0.5, 0.0, -0.1),
        ),
        (
            Velocity2To1,
            iis.TimedVelocity(TM, (3,), 0.5, 0.2, -0.1),
            rtc.TimedVelocity(TM, 0.5, -0.1),
        ),
        (
            Velocity2To3,
            iis.TimedVelocity(TM, (3,), 0.5, 0.2, -0.1, (9.0,)),
            iis.TimedVelocity2D(TM, (3,), Velocity2D(0.5, 0.2, -0.1), (9.0,)),
        ),
        (
            Velocity3To2,
            iis.TimedVelocity2D(TM, (3,), Velocity2D(0.5, 0.2, -0.1), (9.0,)),
            iis.TimedVelocity(TM, (3,), 0.5, 0.2, -0.1, (9.0,)),
        ),
        (Position2To3, iis.TimedPosition(x=1.0, y=2.0, theta=-pi / 2), at(1, 2, 1.5 * pi)),
        (Position3To2, at(1, 2, -pi / 2), iis.TimedPosition(x=1.0, y=2.0, theta=1.5 * pi)),
        (PositiveHeading, at(1, 2, -pi / 2, 7), at(1, 2, 1.5 * pi, 7)),
        (WrappedHeading, at(1, 2, 1.5 * pi, 7), at(1, 2, -pi / 2, 7)),
    ],
)
def test_a_value_passes_as_the_other_phase_says_it(
    kind: Callable[[str], RtComponent], value: Struct, expected: Struct
) -> None:
    on = PortBench(kind("Adapter0"))
    assert on.after("out", "in", value) == [expected]


@pytest.mark.parametrize("number", [nan, inf, -inf])
@pytest.mark.parametrize("kind", [Position2To3, Position3To2, PositiveHeading, WrappedHeading])
def test_a_pose_with_a_number_that_is_none_is_left_out(
    kind: Callable[[str], RtComponent], number: float
) -> None:
    spoilt = iis.TimedPosition(x=number) if kind is Position2To3 else at(1, 2, number)
    on = PortBench(kind("A0"))
    assert on.after("out", "in", spoilt) == []
    assert on.state == "ACTIVE"


@given(numbers, numbers, numbers)
def test_velocities_survive_the_way_to_phase_3_and_back(vx: float, vy: float, w: float) -> None:
    value = iis.TimedVelocity(TM, (1, 2), vx, vy, w, (0.5,))
    assert Velocity3To2("B0").convert(Velocity2To3("A0").convert(value)) == value


@given(numbers, numbers, st.floats(-50, 50))
def test_headings_are_converted_and_mean_the_same(x: float, y: float, heading: float) -> None:
    pose = at(x, y, heading)
    positive = PositiveHeading("A0").convert(pose)
    assert positive is not None
    assert 0 <= positive.data.heading <= 2 * pi
    assert abs(wrap(positive.data.heading - heading)) < 1e-9
    wrapped = WrappedHeading("B0").convert(positive)
    assert wrapped is not None
    assert -pi <= wrapped.data.heading <= pi
    assert abs(wrap(wrapped.data.heading - heading)) < 1e-9
