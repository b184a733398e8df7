from __future__ import annotations

from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.emulators.can.can_bench import frames
from tests.emulators.can.test_can_rig import Node
from tests.emulators.echo import Echo
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import LATE_KEPT, Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.wire.instant import NEVER


class SlowClock:
    """A clock that is late by a fixed time, and notes what it was asked for."""

    def __init__(self, late_us: int) -> None:
        self.worst_late_us, self.asked = late_us, list[int]()

    def wait_until(self, t_us: int, /) -> int:
        self.asked.append(t_us)
        return self.worst_late_us


def test_a_sparse_rig_visits_only_ticks_with_work() -> None:
    line, echo = SerialLine(), Echo(period_us=1_000_000)
    rig = Rig(Station(echo, line.a))
    line.b.send(0, b"x")
    rig.run_for(3_000_000)
    assert echo.ticks == [10_000, 20_000, 1_000_000, 2_000_000, 3_000_000]
    assert rig.now_us == 3_000_000


def test_a_dense_rig_visits_every_tick() -> None:
    line, echo = SerialLine(), Echo()
    Rig(Station(echo, line.a), dense=True).run_for(100_000)
    assert echo.ticks == list(range(10_000, 110_000, 10_000))


@given(st.lists(st.tuples(st.integers(0, 50_000), st.binary(min_size=1, max_size=9)), max_size=9))
def test_dense_and_sparse_runs_send_the_same(sent: list[tuple[int, bytes]]) -> None:
    def heard(*, dense: bool) -> list[tuple[int, bytes]]:
        line = SerialLine()
        rig = Rig(Station(Echo(period_us=70_000), line.a), dense=dense)
        log = []
        for delay_us, data in sent:
            rig.run_for(delay_us)
            log.append((rig.now_us, line.b.poll(rig.now_us)))
            line.b.send(rig.now_us, data)
        rig.run_for(200_000)
        return [*log, (rig.now_us, line.b.poll(rig.now_us))]

    assert heard(dense=False) == heard(dense=True)


def test_devices_with_different_periods_tick_on_their_own_grid() -> None:
    fast, slow = Echo(tick_us=2_000), Echo(tick_us=5_000)
    Rig(Station(fast, SerialLine().a), Station(slow, SerialLine().a), dense=True).run_for(10_000)
    assert fast.ticks == [2_000, 4_000, 6_000, 8_000, 10_000]
    assert slow.ticks == [5_000, 10_000]


def test_what_is_sent_in_a_step_is_not_heard_in_it() -> None:
    line = SerialLine(baud=100_000_000)
    first, second = Echo(period_us=10_000), Echo()
    Rig(Station(first, line.a), Station(second, line.b)).run_for(10_000)
    assert first.ticks == [10_000]
    assert second.ticks == []


def test_a_rig_in_which_nothing_will_happen_only_passes_time() -> None:
    rig = Rig(Station(Echo(), SerialLine().a))
    rig.step()
    assert rig.now_us == 0
    assert rig.next_us == NEVER
    rig.run_for(10**12)
    assert rig.now_us == 10**12


def test_run_until_stops_when_it_is_done() -> None:
    echo = Echo(period_us=100_000)
    rig = Rig(Station(echo, SerialLine().a))
    assert rig.run_until(lambda: len(echo.ticks) == 2, timeout_us=1_000_000)
    assert rig.now_us == 200_000


def test_run_until_gives_up_at_its_timeout() -> None:
    rig = Rig(Station(Echo(period_us=100_000), SerialLine().a))
    assert not rig.run_until(lambda: False, timeout_us=150_000)
    assert rig.now_us == 150_000


def test_a_late_step_is_counted_and_never_skipped() -> None:
    clock, echo = SlowClock(late_us=5_000), Echo(period_us=10_000)
    rig = Rig(Station(echo, SerialLine().a), clock=clock)
    rig.run_for(50_000)
    assert echo.ticks == [10_000, 20_000, 30_000, 40_000, 50_000]
    assert (rig.worst_late_us, rig.late_ticks) == (5_000, 5)


def test_late_steps_are_known_by_their_times() -> None:
    clock = SlowClock(late_us=9_000)
    rig = Rig(Station(Echo(period_us=10_000), SerialLine().a), clock=clock)
    rig.run_for(20_000)
    clock.worst_late_us = 2_000
    rig.run_for(20_000)
    assert [rig.late_since(t_us) for t_us in (0, 20_000, 30_000, 50_000)] == [
        9_000,
        9_000,
        2_000,
        0,
    ]
    rig.run_for(10_000 * LATE_KEPT)
    assert (rig.late_since(20_000), rig.late_since(rig.now_us - 100_000)) == (9_000, 2_000)


def test_of_more_than_a_thousand_late_steps_the_worst_of_all_counts() -> None:
    clock = SlowClock(late_us=9_000)
    rig = Rig(Station(Echo(period_us=10_000), SerialLine().a), clock=clock)
    rig.run_for(10_000)
    clock.worst_late_us = 2_000
    rig.run_for(10_000 * 1_000)
    assert (rig.late_since(15_000), rig.late_since(20_000)) == (9_000, 2_000)


def test_a_step_may_be_late_by_a_microsecond() -> None:
    rig = Rig(Station(Echo(period_us=10_000), SerialLine().a), clock=SlowClock(late_us=1))
    rig.run_for(10_000)
    assert (rig.worst_late_us, rig.late_ticks) == (1, 0)


def test_a_rig_in_real_time_wakes_at_each_tick_but_runs_only_those_with_work() -> None:
    clock, echo = SlowClock(late_us=0), Echo(period_us=30_000)
    Rig(Station(echo, SerialLine().a), clock=clock).run_for(60_000)
    assert clock.asked == [10_000, 20_000, 30_000, 40_000, 50_000, 60_000]
    assert echo.ticks == [30_000, 60_000]


def test_of_several_wires_each_frame_is_heard_at_its_time() -> None:
    quiet, busy = CanWire(), CanWire()
    listener = Node(2, accepts=frozenset({0x80}))
    stations = [Station(Node(1), quiet.end()), Station(listener, busy.end())]
    rig, asked = Rig(*stations), busy.end()
    quiet.end().send(1_000, frames("123#"))
    asked.send(1_000, frames("300#11223344 301#11223344 080#"))
    rig.run_to(10_000)
    assert (listener.heard, listener.ticks) == (["080#"], [2_000, 5_000])


@pytest.mark.parametrize(("late_us", "late_ticks"), [(1_000, 0), (1_001, 3)])
def test_a_step_is_late_beyond_a_millisecond(late_us: int, late_ticks: int) -> None:
    rig = Rig(Station(Echo(period_us=10_000), SerialLine().a), clock=SlowClock(late_us))
    rig.run_for(30_000)
    assert rig.late_ticks == late_ticks


def test_time_without_work_passes_on_the_clock_and_on_the_bus() -> None:
    wire, clock, heard = CanWire(), SlowClock(late_us=0), list[int]()
    wire.observers.append(lambda at_us, frame: heard.append(at_us))
    rig, end = Rig(clock=clock), wire.end()
    wire.end()
    rig.move_on(wire)
    end.send(0, frames("123#"))
    rig.run_to(700)
    assert (clock.asked, heard, rig.now_us) == ([700], [45], 700)
    assert wire.load_permille() == 1_000 * (45 + 3) // 700


def test_what_happens_at_the_deadline_is_in_time() -> None:
    echo = Echo(period_us=10_000)
    rig = Rig(Station(echo, SerialLine().a))
    assert rig.run_until(lambda: bool(echo.ticks), timeout_us=10_000)


class Gate:
    """A joint with the outside world that notes when it is opened."""

    def __init__(self, due_us: int) -> None:
        self.due_us, self.opened = due_us, list[str]()

    def take_in(self, now_us: int, /) -> None:
        self.opened.append(f"in {now_us}")

    def give_out(self, now_us: int, /) -> None:
        self.opened.append(f"out {now_us}")
        self.due_us = NEVER


def test_a_bridge_is_served_when_it_is_due_and_at_each_tick() -> None:
    gate = Gate(due_us=3_300)
    rig = Rig(Station(Echo(period_us=10_000), SerialLine().a), bridges=[gate])
    assert rig.next_us == 3_300
    rig.run_for(10_000)
    assert gate.opened == ["in 3300", "out 3300", "in 10000", "out 10000"]


def test_a_rig_stops_when_a_frame_has_come_to_the_host_that_waits() -> None:
    wire = CanWire()
    host, rig = wire.end(), Rig(Station(Node(1, period_us=10_000), wire.end()))
    rig.run_to(100_000, host)
    assert 10_000 < rig.now_us < 10_100
    assert (host.arrived_us, host.poll(rig.now_us)) == (rig.now_us, frames("101#01"))


@dataclass
class Kick:
    """Lets a node have work at one time."""

    node: Node
    at_us: int
    tick_us: int = 1
    due_us: int = NEVER

    def act(self, now_us: int, /) -> None:
        if now_us == self.at_us:
            self.node.answer_us = 0


def test_a_device_may_have_work_in_the_first_microsecond_and_in_the_next() -> None:
    wire = CanWire()
    node, other = Node(1, tick_us=1, answer_us=1), Node(2, tick_us=1)
    kick = Kick(other, at_us=1, due_us=1)
    Rig(Station(node, wire.end()), Station(other, wire.end()), couplings=[kick]).run_to(5)
    assert (node.ticks, other.ticks) == ([1], [2])


def test_a_frame_that_ends_right_before_the_tick_of_another_device_is_heard_at_its_end() -> None:
    wire = CanWire()
    node = Node(1, tick_us=1, accepts=frozenset({0x705}))
    other, host = Node(2, tick_us=1, answer_us=136), wire.end()
    rig = Rig(Station(node, wire.end()), Station(other, wire.end()))
    host.send(80, frames("705#7F"))
    rig.run_to(140)
    assert (node.ticks, other.ticks) == ([135], [136])


def test_of_two_wires_the_second_brings_a_frame_to_the_last_tick_of_a_run() -> None:
    first, second = CanWire(), CanWire()
    node, hosts = Node(1, accepts=None), (first.end(), second.end())
    rig = Rig(Station(Node(2), first.end()), Station(node, second.end()))
    hosts[0].send(0, frames("123#"))
    hosts[1].send(1_000 - 55, frames("705#7F"))
    rig.run_to(1_000)
    assert node.ticks == [1_000]
