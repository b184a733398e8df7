"""Option codes: a wheel at 1000 rpm is stopped, and how long it takes tells the ramp."""

from __future__ import annotations

import pytest

from tests.device.canopen.ds402.wheel import Wheel
from tickrig.device.canopen.dictionary import SdoAbort
from tickrig.wire.canopen.drive import DriveState

SOD = DriveState.SWITCH_ON_DISABLED
QUICK_STOP = DriveState.QUICK_STOP_ACTIVE

SLOW_MS = range(195, 215)
"""1000 rpm with 5000 rpm/s."""

QUICK_MS = range(46, 60)
"""1000 rpm with 20 000 rpm/s."""

HARD_MS = range(2, 30)
"""As fast as 10 A brake."""

COASTS = range(2)
"""The power stage is off at once."""


@pytest.fixture
def wheel() -> Wheel:
    wheel = Wheel()
    wheel.write(0x6084, 5_000)
    wheel.write(0x6085, 20_000)
    wheel.write(0x60FF, 1_000)
    wheel.enable(3)
    wheel.run(300)
    assert wheel.read(0x606C) == pytest.approx(1_000, abs=2)
    return wheel


def stands(wheel: Wheel) -> bool:
    return abs(wheel.read(0x606C)) < 10 and wheel.read(0x606B) == 0


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("option", "duration_ms", "state"),
    [
        (0, COASTS, SOD),
        (1, SLOW_MS, SOD),
        (2, QUICK_MS, SOD),
        (3, HARD_MS, SOD),
        (5, SLOW_MS, QUICK_STOP),
        (6, QUICK_MS, QUICK_STOP),
        (7, HARD_MS, QUICK_STOP),
    ],
)
def test_a_quick_stop_follows_605ah(
    wheel: Wheel, option: int, duration_ms: range, state: DriveState
) -> None:
    wheel.write(0x605A, option)
    wheel.write(0x6040, 0x02)
    ended = (lambda: wheel.drive.state is SOD) if state is SOD else lambda: stands(wheel)
    assert wheel.run_until(ended) in duration_ms
    assert wheel.drive.state is state
    assert (wheel.read(0x606C) > 900) is (option == 0)


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("index", "controlword", "state"),
    [
        (0x605B, 0x06, DriveState.READY_TO_SWITCH_ON),
        (0x605C, 0x07, DriveState.SWITCHED_ON),
    ],
)
@pytest.mark.parametrize(("option", "duration_ms"), [(0, COASTS), (1, SLOW_MS)])
def test_operation_enabled_is_left_as_605bh_and_605ch_say(  # noqa: PLR0913, PLR0917 - a table
    wheel: Wheel,
    index: int,
    controlword: int,
    state: DriveState,
    option: int,
    duration_ms: range,
) -> None:
    wheel.write(index, option)
    wheel.write(0x6040, controlword)
    assert wheel.run_until(lambda: wheel.drive.state is state) in duration_ms


def test_a_ramp_out_of_operation_enabled_is_called_off_by_enabling_again(wheel: Wheel) -> None:
    wheel.control(0x07)
    wheel.run(100)
    assert 400 < wheel.read(0x606C) < 600
    wheel.control(0x0F)
    wheel.run(300)
    assert wheel.read(0x606C) == pytest.approx(1_000, abs=2)


@pytest.mark.unmeasured
@pytest.mark.parametrize(("option", "duration_ms"), [(1, SLOW_MS), (2, QUICK_MS), (3, HARD_MS)])
def test_halt_follows_605dh_and_stays_enabled(
    wheel: Wheel, option: int, duration_ms: range
) -> None:
    wheel.write(0x605D, option)
    wheel.write(0x6040, 0x10F)
    assert wheel.run_until(lambda: stands(wheel)) in duration_ms
    wheel.run(5)
    assert wheel.read(0x6041) & 0x0400
    assert wheel.drive.enabled


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("option", "duration_ms"), [(0, COASTS), (1, SLOW_MS), (2, QUICK_MS), (3, HARD_MS)]
)
def test_a_fault_that_leaves_control_is_reacted_to_as_605eh_says(
    wheel: Wheel, option: int, duration_ms: range
) -> None:
    wheel.write(0x605E, option)
    wheel.drive.fault(0x8611)
    assert wheel.run_until(lambda: wheel.drive.state is DriveState.FAULT) in duration_ms


def test_a_fault_of_the_power_stage_switches_off_during_another_reaction(wheel: Wheel) -> None:
    wheel.write(0x605E, 1)
    wheel.drive.fault(0x8611)
    wheel.run(50)
    assert wheel.read(0x6041) & 0x4F == DriveState.FAULT_REACTION_ACTIVE
    wheel.drive.fault(0x2310)
    wheel.step()
    assert wheel.drive.state is DriveState.FAULT
    assert wheel.read(0x606C) > 500


def test_a_quick_stop_in_torque_mode_brakes_by_velocity(wheel: Wheel) -> None:
    wheel.write(0x6060, 4)
    wheel.run(10)
    wheel.write(0x6040, 0x02)
    assert wheel.run_until(lambda: wheel.drive.state is SOD) in range(40, 65)


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("index", "value"),
    [
        *((0x6007, 4), (0x605A, 4), (0x605A, 8), (0x605A, -1), (0x605B, 2), (0x605C, 2)),
        *((0x605D, 0), (0x605D, 4), (0x605E, 4), (0x605E, -1)),
    ],
)
def test_an_option_that_is_not_there_is_refused(wheel: Wheel, index: int, value: int) -> None:
    with pytest.raises(SdoAbort, match="VALUE_RANGE"):
        wheel.write(index, value)
