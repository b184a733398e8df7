from __future__ import annotations

import pytest

from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.service import Service
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.canopen.nmt.nmt_slave import NmtSlave
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
