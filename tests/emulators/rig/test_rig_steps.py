"""What a rig says of itself in a step, what it tells devices, and how far its wires have come."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.emulators.can.can_bench import frames
from tests.emulators.can.test_can_rig import Node
from tests.emulators.echo import Echo
from tests.emulators.rig.test_rig import Kick
from tickrig.device.horizon import Horizon
from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER


class Probe:
    """Has work in each tick, and notes how far it may work ahead."""

    tick_us, due_us = 1_000, 0

    def __init__(self) -> None:
        self.horizon: Horizon | None = None
        self.foreseen = list[int]()

    def reset(self) -> None:
        raise NotImplementedError

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        assert self.horizon is not None
        self.foreseen.append(self.horizon.until_us)
        return ()


def test_a_rig_is_in_a_step_only_while_it_does_one() -> None:
    rig = Rig(Station(Echo(period_us=10_000), SerialLine().a))
    seen = [rig.in_step]
    rig.watchers.append(lambda now_us: seen.append(rig.in_step))
    rig.run_for(10_000)
    assert [*seen, rig.in_step] == [False, True, False]


def test_a_fork_made_in_a_step_is_in_none() -> None:
    rig, twins = Rig(Station(Echo(), SerialLine().a)), list[Rig]()
    rig.event_queue.put("fork", 5_000, lambda now_us: twins.append(rig.fork()))
    rig.run_to(5_000)
    assert [(twin.in_step, twin.acting_us) for twin in twins] == [(False, None)]


def test_a_snapshot_puts_a_rig_back() -> None:
    rig = Rig(Station(Echo(period_us=10_000), SerialLine().a))
    snapshot = rig.snapshot()
    rig.run_for(15_000)
    snapshot.restore()
    assert (rig.now_us, rig.next_us) == (0, 10_000)


def test_who_waits_for_ever_waits_no_longer_than_something_happens() -> None:
    rig = Rig(Station(Echo(), SerialLine().a))
    assert not rig.run_until(lambda: False, NEVER)
    assert rig.now_us == 0


def test_watchers_look_when_the_queue_wakes_the_rig() -> None:
    rig, seen = Rig(), list[int]()
    rig.watchers.append(seen.append)
    rig.event_queue.wake("look", 5_000)
    rig.run_to(6_000)
    assert seen == [5_000]


def test_a_device_that_a_watcher_gives_work_has_it_in_the_next_tick() -> None:
    wire = CanWire()
    node, other = Node(1), Node(2, period_us=5_000)
    rig = Rig(Station(node, wire.end()), Station(other, wire.end()))
    rig.watchers.append(lambda now_us: setattr(node, "answer_us", now_us))
    rig.run_to(6_000)
    assert node.ticks == [6_000]


def test_a_frame_that_ends_with_the_tick_of_another_device_is_heard_in_it() -> None:
    wire = CanWire()
    node, host = Node(1, accepts=None), wire.end()
    rig = Rig(Station(node, wire.end()), Station(Node(2, answer_us=1_000), wire.end()))
    host.send(1_000 - 55, frames("705#7F"))
    rig.run_to(1_000)
    assert node.ticks == [1_000]


def step(rig: Rig, host: CanEnd) -> None:
    while rig.now_us < 10_000:
        rig.step()


def wait_at_host(rig: Rig, host: CanEnd) -> None:
    rig.run_to(50_000, host)


def wait_until(rig: Rig, host: CanEnd) -> None:
    rig.run_until(lambda: rig.now_us >= 10_000, 50_000)


WAYS = {"step": step, "host": wait_at_host, "until": wait_until}
Way = Callable[[Rig, CanEnd], None]


@pytest.mark.parametrize("go", WAYS.values(), ids=WAYS)
def test_a_wire_without_work_has_come_as_far_as_the_rig(go: Way) -> None:
    wire, quiet = CanWire(), CanWire()
    host, rig = wire.end(), Rig(Station(Node(1, period_us=10_000), wire.end()))
    rig.move_on(quiet)
    go(rig, host)
    assert rig.now_us >= 10_000
    assert quiet.bus.now_us == rig.now_us


def test_a_watcher_sees_a_wire_without_work_as_far_as_the_rig() -> None:
    wire, quiet, seen = CanWire(), CanWire(), list[tuple[int, int]]()
    _, rig = wire.end(), Rig(Station(Node(1, period_us=10_000), wire.end()))
    rig.move_on(quiet)
    rig.watchers.append(lambda now_us: seen.append((now_us, quiet.bus.now_us)))
    rig.run_to(15_000)
    assert seen == [(10_000, 10_000)]


def test_devices_may_work_ahead_up_to_the_end_of_a_run_or_the_next_action() -> None:
    probe, wire = Probe(), CanWire()
    rig = Rig(Station(probe, wire.end()))
    rig.event_queue.wake("action", 3_000)
    rig.run_to(5_000)
    assert probe.foreseen == [2_999, 2_999, 5_000, 5_000, 5_000]
    rig.run_to(6_000, unseen_us=250)
    assert probe.foreseen[5:] == [6_250]


@pytest.mark.parametrize("go", WAYS.values(), ids=WAYS)
def test_who_may_look_after_each_step_lets_no_device_work_ahead(go: Way) -> None:
    probe, wire = Probe(), CanWire()
    rig, host = Rig(Station(probe, wire.end())), wire.end()
    rig.run_to(1_000, unseen_us=90_000)
    go(rig, host)
    assert set(probe.foreseen[1:]) == {0}


def test_watchers_and_couplings_let_no_device_work_ahead() -> None:
    watched, coupled = Probe(), Probe()
    rig = Rig(Station(watched, CanWire().end()))
    rig.watchers.append(lambda now_us: None)
    other = Rig(Station(coupled, CanWire().end()), couplings=[Kick(Node(1), NEVER)])
    for each in (rig, other):
        each.run_to(1_000)
    assert watched.foreseen == coupled.foreseen == [0]
