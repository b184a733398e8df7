"""No change of the mode makes the reference jump, whatever the wheel is doing."""

from __future__ import annotations

from itertools import permutations

import pytest

from tests.device.canopen.ds402.wheel import RPM, TURN, Wheel

TARGETS = {
    1: (0x607A, 30_000),
    3: (0x60FF, 600),
    4: (0x6071, 100),
    6: (0x6098, 35),
    7: (0x60C1, 0),
    8: (0x607A, 0),
    9: (0x60FF, 600),
    10: (0x6071, 100),
    -1: (0x2062, 0),
    -2: (0x206B, 600),
    -3: (0x2030, 300),
}
"""Object and value that keep the wheel turning in a mode; 0: only while it is chosen."""

RAMP_MS = 10_000 * RPM / 1_000
"""Counts per second that 10 000 rpm/s change in a millisecond."""

MEASURED = 0.02 * 600 * RPM
"""The reference takes the measured velocity where the mode before did not control it."""


CHANGES = [
    pytest.param(*change, marks=() if change in {(-1, -2), (-1, -3)} else pytest.mark.unmeasured)
    for change in permutations(TARGETS, 2)
]
"""Each mode after each other; two of these are all that no other test reaches."""


def begin(mode: int, *, moving: bool) -> Wheel:
    wheel = Wheel()
    wheel.enable(mode)
    index, value = TARGETS[mode]
    if moving and value:
        wheel.write(index, value, sub=1 if index == 0x60C1 else 0)
        wheel.control(0x1F)
        wheel.run(70)
    return wheel


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize(("before", "after"), CHANGES)
def test_the_reference_goes_on_where_it_was(before: int, after: int, moving: bool) -> None:
    wheel = begin(before, moving=moving)
    reference = wheel.drive.axis.reference
    position, velocity = reference.position, reference.velocity
    wheel.write(0x6060, after)
    for _ in range(30):
        wheel.step()
        most = max(abs(velocity), abs(reference.velocity), 0.5 * TURN)
        assert abs(reference.position - position) <= 1.1 * most / 1_000 + 2
        assert abs(reference.velocity - velocity) <= RAMP_MS + MEASURED
        position, velocity = reference.position, reference.velocity
    assert wheel.read(0x6061) == after
    assert wheel.drive.enabled


@pytest.mark.parametrize("mode", [8, -1])
def test_a_position_target_is_the_reference_until_another_is_written(mode: int) -> None:
    wheel = begin(3, moving=True)
    wheel.write(0x6060, mode)
    wheel.run(200)
    assert wheel.read(TARGETS[mode][0]) == wheel.read(0x6062) > 0
    assert wheel.read(0x606C) == pytest.approx(0, abs=5)


def test_enabling_in_csp_holds_the_position_whatever_the_target_was() -> None:
    wheel = Wheel()
    wheel.write(0x607A, 5_000)
    wheel.enable(8)
    wheel.run(50)
    assert (wheel.read(0x607A), wheel.read(0x6064)) == (0, 0)


def test_enabling_in_csv_has_the_velocity_that_was_written_before() -> None:
    wheel = Wheel()
    wheel.write(0x60FF, 200)
    wheel.enable(9)
    wheel.run(200)
    assert wheel.read(0x606C) == pytest.approx(200, abs=2)
