from __future__ import annotations

from math import nan

from tests.host.rtc.motion.port_bench import PortBench
from tickrig.host.rtc.motion.options.switch_input import SwitchInput
from tickrig.wire.rtc_types import iis
from tickrig.wire.rtc_types.rtc import Velocity2D

PLANNED, PUSHED = Velocity2D(vx=0.3), Velocity2D(vx=-0.1, va=0.2)


def bench(**settings: str) -> PortBench[SwitchInput]:
    return PortBench(SwitchInput("SwitchInput0"), **settings)


def driven(
    on: PortBench[SwitchInput], hand: Velocity2D | None = None, periods: int = 1
) -> list[float]:
    """Return what vx is commanded while the planner plans and a hand does something."""
    on.taken("velocity")
    for _ in range(periods):
        on.feed("automatic", iis.TimedVelocity2D(data=PLANNED))
        if hand is not None:
            on.feed("joystick", iis.TimedVelocity2D(data=hand))
        on.period()
    return [value.data.vx for value in on.taken("velocity")]


def test_the_planner_drives_while_no_hand_pushes() -> None:
    assert driven(bench(), periods=3) == [0.3] * 3


def test_the_joystick_wins() -> None:
    on = bench()
    driven(on)
    assert driven(on, PUSHED, 3) == [-0.1] * 3


def test_the_planner_resumes_half_a_second_after_the_hand_let_go() -> None:
    on = bench()
    driven(on, PUSHED, 10)
    assert driven(on, Velocity2D(), 1) == [0.0]
    after = driven(on, periods=40)
    assert after.count(0.0) == 24  # 500 ms after the last push, with that of letting go
    assert after[24:] == [0.3] * 16


def test_a_joystick_that_falls_silent_lets_go() -> None:
    on = bench()
    driven(on, PUSHED)
    after = driven(on, periods=40)
    assert after[:5] == [-0.1] * 5
    assert after[5] == 0.0
    assert after[-1] == 0.3


def test_a_joystick_that_says_0_takes_nothing() -> None:
    assert driven(bench(), Velocity2D(), 30)[-1] == 0.3


def test_without_a_planner_nothing_is_said() -> None:
    on = bench()
    on.period(5)
    assert on.taken("velocity") == []


def test_a_velocity_with_a_number_that_is_none_is_0() -> None:
    on = bench()
    assert driven(on, Velocity2D(vx=nan)) == [0.3]
    on.feed("automatic", iis.TimedVelocity2D(data=Velocity2D(va=nan)))
    on.period()
    assert on.taken("velocity")[-1].data == Velocity2D()


def test_a_push_before_activation_is_forgotten() -> None:
    on = bench()
    driven(on, PUSHED)
    on.deactivate()
    on.feed("joystick", iis.TimedVelocity2D(data=PUSHED))
    on.activate()
    assert driven(on) == [0.3]
