from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest
from durand.scheduler import get_scheduler

from tests.emulators.testing.conformance.stacks import durand, local_node, ours
from tickrig.emulators.testing.conformance.conformance import PoweredSlave
from tickrig.emulators.testing.conformance.slave import CalledSlave, Slave
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.instant import NEVER

STACKS = pytest.mark.parametrize("make", [ours, local_node, durand])


def texts(frames: Frames) -> list[str]:
    return [str(frame) for frame in frames]


def run(slave: Slave, until_us: int) -> list[tuple[int, str]]:
    """Call a slave when it is due, and tell what it sent when."""
    sent = []
    now_us = 0
    while (now_us := max(now_us + 1_000, -(-slave.due_us // 1_000) * 1_000)) <= until_us:
        sent += [(now_us, str(frame)) for frame in slave.tick(now_us, ())]
    return sent


@STACKS
def test_a_stack_boots_once(make: Callable[[], Slave]) -> None:
    assert run(make(), 500_000) == [(1_000, "705#00")]


@STACKS
def test_a_stack_boots_again_after_a_reset(make: Callable[[], Slave]) -> None:
    slave = make()
    run(slave, 100_000)
    slave.reset()
    assert texts(slave.tick(101_000, ())) == ["705#00"]


@STACKS
def test_a_heartbeat_follows_the_time_that_is_told(make: Callable[[], Slave]) -> None:
    slave = make()
    slave.tick(1_000, ())
    slave.tick(2_000, (CanFrame.parse("605#2B17100064000000"),))
    heard = [at_us for at_us, text in run(slave, 1_000_000) if text == "705#7F"]
    assert len(heard) == pytest.approx(10, abs=1)
    assert {late - early for early, late in pairwise(heard)} == {100_000}


@STACKS
def test_a_frame_that_upsets_a_stack_does_not_end_it(make: Callable[[], Slave]) -> None:
    slave = make()
    slave.tick(1_000, ())
    slave.tick(2_000, (CanFrame(0x605), CanFrame(0), CanFrame.parse("605#R8")))
    answers = texts(slave.tick(3_000, (CanFrame.parse("605#4000100000000000"),)))
    assert [text[:12] for text in answers] == ["585#43001000"]


def test_the_scheduler_of_durand_is_put_back() -> None:
    before = get_scheduler()
    run(durand(), 100_000)
    assert get_scheduler() is before


def test_a_slave_without_power_is_silent_and_boots_when_it_is_back() -> None:
    slave = PoweredSlave(ours())
    slave.tick(1_000, ())
    slave.switch(on=False)
    assert slave.due_us == NEVER
    assert slave.tick(2_000, (CanFrame.parse("605#4000100000000000"),)) == ()
    slave.switch(on=True)
    assert slave.due_us == 0
    assert texts(slave.tick(3_000, ())) == ["705#00"]


def test_a_callable_is_called_each_millisecond_and_made_anew_at_power_on() -> None:
    def make() -> Callable[[int, Frames], Frames]:
        calls: list[int] = []

        def call(now_us: int, frames: Frames) -> Frames:
            calls.append(now_us)
            return (CanFrame(0x700 + len(calls)),)

        return call

    slave = CalledSlave(make)
    assert run(slave, 2_000) == [(1_000, "701#"), (2_000, "702#")]
    slave.reset()
    assert texts(slave.tick(3_000, ())) == ["701#"]
