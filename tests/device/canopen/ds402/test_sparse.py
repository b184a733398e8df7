"""Idle ticks that are left out are not visible: the same traffic to the byte."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.device.canopen.ds402.wheel import Wheel
from tests.soak import examples

pytestmark = pytest.mark.unmeasured

Step = tuple[int, Callable[[Wheel], None]]


def _writes(*pairs: tuple[int, int]) -> Callable[[Wheel], None]:
    def act(wheel: Wheel) -> None:
        for index, value in pairs:
            wheel.write(index, value)

    return act


def _sync(wheel: Wheel) -> None:
    wheel.step("080#")


ACTIONS: dict[str, Callable[[Wheel], None]] = {
    "shutdown": _writes((0x6040, 0x06)),
    "switch on": _writes((0x6040, 0x07)),
    "enable": _writes((0x6040, 0x0F)),
    "start": _writes((0x607A, 3_000), (0x6040, 0x1F)),
    "quick stop": _writes((0x6040, 0x02)),
    "halt": _writes((0x6040, 0x10F)),
    "fault reset": _writes((0x6040, 0x80)),
    "position": _writes((0x6060, 1)),
    "velocity": _writes((0x6060, 3), (0x60FF, 400)),
    "homing": _writes((0x6060, 6), (0x6098, 35)),
    "cyclic position": _writes((0x6060, 8), (0x607A, 500)),
    "cyclic velocity": _writes((0x6060, 9), (0x60FF, -200)),
    "torque": _writes((0x6060, 4), (0x6071, 200)),
    "maxon current": _writes((0x6060, -3), (0x2030, 300)),
    "search": _writes((0x6060, 6), (0x6098, 33), (0x6040, 0x1F)),
    "search in vain": _writes((0x6060, 6), (0x6098, 19), (0x6040, 0x1F)),
    "switch": lambda wheel: wheel.set(home_switch=1),
    "limit": lambda wheel: wheel.set(negative_limit_switch=1),
    "interpolation": lambda wheel: wheel.write(0x6060, 7),
    "record": lambda wheel: wheel.write(0x60C1, 300, 1),
    "sync": _sync,
    "next set-point": _writes((0x607A, -1_000), (0x6040, 0x0F), (0x6040, 0x1F)),
    "passed set-point": _writes((0x607A, 9_000), (0x6040, 0x20F), (0x6040, 0x21F)),
    "block": lambda wheel: wheel.set(shaft_blocked=1),
    "let go": lambda wheel: wheel.set(shaft_blocked=0),
    "push": lambda wheel: wheel.set(load_nm=2.5),
    "dip": lambda wheel: wheel.set(supply_v=8.0),
    "supply": lambda wheel: wheel.set(supply_v=24.0),
}


def play(steps: list[tuple[str, int]], *, sparse: bool) -> list[tuple[int, str]]:
    """Act, and let time pass after each action; return what was sent and when."""
    wheel, sent = Wheel(), list[tuple[int, str]]()
    wheel.step("000#0100")
    for name, pause_ms in steps:
        ACTIONS[name](wheel)
        end_us = wheel.now_us + 1_000 * pause_ms
        while wheel.now_us < end_us:
            due_us = max(wheel.slave.due_us, wheel.now_us + 1_000)
            if sparse and due_us > wheel.now_us + 1_000:
                wheel.now_us = min(due_us, end_us) - 1_000
            sent += [(wheel.now_us, text) for text in wheel.step()]
    sent += [(wheel.now_us, str(wheel.read(index))) for index in (0x6041, 0x6064, 0x606C)]
    return sent


@pytest.mark.parametrize("mode", ["velocity", "position", "cyclic velocity", "torque"])
def test_a_whole_life_is_the_same_without_idle_ticks(mode: str) -> None:
    steps = [(mode, 5), ("shutdown", 5), ("switch on", 5), ("enable", 5), ("start", 700)]
    steps += [("halt", 700), ("dip", 300), ("supply", 50), ("fault reset", 400), ("push", 500)]
    assert play(steps, sparse=True) == play(steps, sparse=False)


@pytest.mark.parametrize("pause_ms", [3, 400])
def test_set_points_homing_and_records_are_the_same_without_idle_ticks(pause_ms: int) -> None:
    names = ["position", "start", "next set-point", "passed set-point", "halt", "enable"]
    names += ["search", "enable", "search in vain", "switch", "enable", "limit", "search"]
    names += ["interpolation", "enable", "record", "start", "sync", "enable", "sync"]
    steps = [("shutdown", 2), ("enable", 2), *((name, pause_ms) for name in names)]
    assert play(steps, sparse=True) == play(steps, sparse=False)


@settings(max_examples=examples(15), deadline=None)
@given(st.lists(st.tuples(st.sampled_from(sorted(ACTIONS)), st.integers(1, 400)), max_size=8))
def test_whatever_is_done_to_it_idle_ticks_are_not_visible(steps: list[tuple[str, int]]) -> None:
    steps = [("shutdown", 2), ("enable", 2), *steps]
    assert play(steps, sparse=True) == play(steps, sparse=False)
