from __future__ import annotations

import pickle

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.nmt import NmtSlave
from tickrig.device.canopen.slave import CanopenSlave, Service
from tickrig.wire.instant import NEVER


class First(Service):
    """Notes when it is run."""

    def power_on(self) -> None:
        self.runs: list[int] = []

    def tick(self, now_us: int) -> None:
        self.runs.append(now_us)


class Second(First):
    """The same, at a later place."""


class Cutter(Service):
    """Cuts the power when it is run."""

    def tick(self, now_us: int) -> None:
        self.node.reset()


@pytest.fixture
def bus() -> Bus:
    bus = Bus(CanopenSlave(Dictionary([]), 5, (NmtSlave, First, Second, Cutter)))
    assert bus.step() == ["705#00"]
    return bus


def test_a_service_is_run_once_when_it_is_due(bus: Bus) -> None:
    First.of(bus.slave).schedule(3_000)
    assert bus.slave.due_us == 3_000
    bus.run(5)
    assert First.of(bus.slave).runs == [3_000]
    assert bus.slave.due_us == NEVER


def test_the_earliest_counts_and_the_last_word_of_a_service(bus: Bus) -> None:
    Second.of(bus.slave).schedule(4_000)
    First.of(bus.slave).schedule(3_000)
    assert bus.slave.due_us == 3_000
    First.of(bus.slave).schedule(9_000)
    assert bus.slave.due_us == 4_000
    Second.of(bus.slave).schedule(NEVER)
    assert bus.slave.due_us == 9_000


def test_a_slave_without_power_is_due_at_once_whatever_its_services_wait_for() -> None:
    slave = CanopenSlave(Dictionary([]), 5, (NmtSlave, First))
    for due_us in (0, 5_000):
        First.of(slave).schedule(due_us)
    assert slave.due_us == 0


def test_services_that_are_due_in_one_tick_are_all_run(bus: Bus) -> None:
    first, second = First.of(bus.slave), Second.of(bus.slave)
    first.schedule(2_000)
    second.schedule(2_000)
    bus.step()
    assert (first.runs, second.runs) == ([2_000], [2_000])


def test_a_service_that_asks_often_takes_no_more_memory(bus: Bus) -> None:
    sizes: list[int] = []
    for _ in range(2):
        for _ in range(100):
            bus.slave.schedule(1, bus.now_us)
            bus.step()
        First.of(bus.slave).runs.clear()
        sizes.append(len(pickle.dumps(bus.slave)))
    assert sizes[1] < sizes[0] + 20


def test_power_that_is_cut_in_a_tick_is_off_after_it(bus: Bus) -> None:
    Cutter.of(bus.slave).schedule(2_000)
    bus.step()
    assert bus.slave.due_us == 0
    First.of(bus.slave).schedule(9_000)
    assert bus.slave.due_us == 0
    assert bus.step() == ["705#00"]


def test_a_slave_without_a_service_does_not_find_it(bus: Bus) -> None:
    class Third(Service):
        """Not there."""

    with pytest.raises(StopIteration):
        Third.of(bus.slave)


SLOTS = 5
Request = tuple[int, int]
"""A slot, and in how many ms it asks for a tick; 0 and less are due, 9 is never."""

requests = st.tuples(st.integers(0, SLOTS - 1), st.integers(-1, 9))


class Asker(Service):
    """Asks for ticks as it is told, for itself and for others."""

    log: list[tuple[int, int]]
    told: list[list[Request]]

    def tick(self, now_us: int) -> None:
        self.log.append((now_us, self.slot))
        for slot, after_ms in self.told.pop() if self.told else ():
            self.node.schedule(slot, NEVER if after_ms == 9 else now_us + 1_000 * after_ms)


class PlainSlave:
    """Asks all services in each tick: what a slave does that takes no short way."""

    def __init__(self, told: list[list[Request]]) -> None:
        self.dues, self.told, self.log = [NEVER] * SLOTS, told, list[tuple[int, int]]()

    def tick(self, now_us: int) -> None:
        for slot in range(SLOTS):
            if self.dues[slot] <= now_us:
                self.dues[slot] = NEVER
                self.log.append((now_us, slot))
                for other, after_ms in self.told.pop() if self.told else ():
                    self.schedule(other, NEVER if after_ms == 9 else now_us + 1_000 * after_ms)

    def schedule(self, slot: int, due_us: int) -> None:
        self.dues[slot] = due_us


@pytest.mark.unmeasured
@given(
    st.lists(st.lists(requests, max_size=3), max_size=20),
    st.lists(st.lists(requests, max_size=2), max_size=8),
)
@example([[(1, 0), (2, 5)]], [[(1, 0)]])  # for itself, beside one that has never asked
@example([[(2, 0)], [], [(4, 0)]], [[(1, 0), (2, 0)]])  # for one whose turn is over
def test_a_slave_runs_what_one_runs_that_asks_all_services(
    told: list[list[Request]], between: list[list[Request]]
) -> None:
    slave = CanopenSlave(Dictionary([]), 5, (Asker,) * SLOTS)
    Asker.log, Asker.told = [], [list(each) for each in told]
    plain = PlainSlave([list(each) for each in told])
    slave.tick(1_000, ())
    for now_us in range(2_000, 2_000 + 1_000 * len(between), 1_000):
        for slot, after_ms in between[now_us // 1_000 - 2]:
            due_us = NEVER if after_ms == 9 else now_us + 1_000 * after_ms
            slave.schedule(slot, due_us)
            plain.schedule(slot, due_us)
        assert slave.due_us == min(plain.dues)
        slave.tick(now_us, ())
        plain.tick(now_us)
        assert (slave.due_us, Asker.log) == (min(plain.dues), plain.log)
