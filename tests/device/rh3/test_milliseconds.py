"""Milliseconds that nobody ticked: made up for in one go, to the bit."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.device.rh3.driven import M_S, Driven
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.wire.modbus import Command, Mode

COUNTS_S = round(M_S)

Act = tuple[int, object]

orders = st.one_of(
    st.tuples(st.sampled_from(["target_speed_left", "target_speed_right"]), st.integers(-9, 9)).map(
        lambda order: {order[0]: order[1] * COUNTS_S // 10}
    ),
    st.integers(-3, 3).map(lambda turns: {"target_position_left": turns * 2_000}),
    st.sampled_from(Mode).map(lambda mode: {"mode": mode}),
    st.sampled_from(Command).map(lambda command: {"command": command}),
    st.sampled_from([{"gain_vi": 3}, {"gain_vd": 7}, {"acceleration_limit": COUNTS_S}]),
    st.sampled_from([{"watchdog_ms": 0}, {"watchdog_ms": 90}, {"speed_limit": COUNTS_S // 4}]),
)
inputs = st.sampled_from(
    [
        *(("load_left_nm", 3.0), ("load_right_nm", -2.5), ("load_left_nm", 0.0)),
        *(("jam_left", 1), ("jam_left", 0), ("emergency_stop", 1), ("emergency_stop", 0)),
        *(("power_cut", 1), ("power_cut", 0), ("encoder_unplugged_right", 1)),
    ]
)
gaps_ms = st.integers(1, 40) | st.just(600)
acts = st.lists(st.tuples(gaps_ms, orders | inputs), max_size=10)
parameters = st.builds(
    BaseParameters,
    noise=st.sampled_from([0.0, 0.1]),
    friction=st.sampled_from([None, 0.02, 0.5]),
    delay_ms=st.sampled_from([0, 0, 7, 40]),
)


def seen(driven: Driven) -> list[object]:
    base = driven.base
    sides = [(s.wheel.travel, s.wheel.speed, s.torque, s.clipped, s.fault) for s in base.sides]
    ground = base.ground
    return [*sides, base.status, ground.pose, ground.speed_m_s, ground.turn_rad_s]


STALLED = [
    (10, {"target_speed_left": COUNTS_S * 3 // 5}),
    *((300, ("jam_left", 1)), (40, {"gain_vi": 3}), (600, {"command": Command.CLEAR_FAULT})),
]


def test_a_wheel_that_stalls_and_is_cleared_is_that_of_a_base_that_is_ticked() -> None:
    compare(BaseParameters(), STALLED)


def test_an_order_that_takes_effect_between_ticks_does_so_in_its_millisecond() -> None:
    orders: tuple[Act, ...] = ((3, {"target_speed_left": COUNTS_S // 5}), (60, {"watchdog_ms": 90}))
    compare(BaseParameters(delay_ms=40), [*orders, *orders])


@pytest.mark.unmeasured
@given(parameters, acts)
def test_they_are_those_of_a_base_that_is_ticked(
    parameters: BaseParameters, acts: list[tuple[int, object]]
) -> None:
    compare(parameters, acts)


def compare(parameters: BaseParameters, acts: Sequence[Act]) -> None:
    ticked, left_alone = Driven(parameters), Driven(parameters)
    for driven in (ticked, left_alone):
        driven.enable()
        driven.drive(0.4, 0.3)
    for gap_ms, act in acts:
        ticked.run(gap_ms)
        left_alone.now_us += 1_000 * (gap_ms - 1)
        left_alone.run(1)
        assert seen(left_alone) == seen(ticked)
        for driven in (ticked, left_alone):
            if isinstance(act, dict) and not driven.base.inputs["power_cut"]:
                driven.write(**act)
            elif isinstance(act, tuple):
                driven.base.inputs.set(*act)
                driven.run(1)  # an input is due at once


@pytest.mark.parametrize("run_ms", [10, 31, 37, 45, 51, 52, 59])
def test_at_standstill_it_shows_the_torque_that_it_keeps(run_ms: int) -> None:
    torques = []
    for dense in (True, False):
        driven = Driven(dense=dense)
        driven.write(watchdog_ms=0)
        driven.enable()
        driven.drive(0.1, 0.1)
        driven.run(run_ms)
        driven.drive(0.0, 0.0)
        driven.run(700)
        torques.append(driven.base.read("torque_right_pm"))
    assert torques == [0.0, 0.0]
