"""Devices on a CAN wire in a rig: what is an optimisation must not be seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.emulators.can.can_bench import Log, frames
from tickrig.device.twin import Listeners
from tickrig.emulators.can.bus_device import Accepted
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.can import CanFrame, ErrorState, Frames
from tickrig.wire.instant import NEVER

SWITCH = 0x101
BURST = ("100#0102", "101#", "102#", "203#", "202#")


@dataclass
class Node:
    """Answers what it accepts after a while, each time with more; sends by itself each period.

    The frame `SWITCH` changes what it accepts, from the next frame on.
    """

    number: int
    tick_us: int = 1_000
    period_us: int = NEVER
    delay_us: int = 3_000
    accepts: Accepted = frozenset()
    reconfigured_by: frozenset[int] = frozenset({SWITCH})
    on_accepts: Listeners[Callable[[], None]] = field(default_factory=Listeners)
    ticks: list[int] = field(default_factory=list)
    heard: list[str] = field(default_factory=list)
    count: int = 0
    answer_us: int = NEVER
    beat_us: int = field(default=NEVER, init=False)
    state: ErrorState = ErrorState.ACTIVE

    def __post_init__(self) -> None:
        self.beat_us = self.period_us

    @property
    def due_us(self) -> int:
        return min(self.answer_us, self.beat_us)

    def reset(self) -> None:
        self.count = 0

    def bus_state(self, state: ErrorState) -> None:
        self.state, self.answer_us = state, 0

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        self.ticks.append(now_us)
        out: Frames = ()
        wanted = [frame for frame in rx if self.hears(frame)]
        if wanted and self.answer_us == NEVER:
            self.answer_us = now_us + self.delay_us
        if now_us >= self.answer_us:
            self.answer_us, self.count = NEVER, self.count + 1
            out += (CanFrame(0x200 + self.number, self.count.to_bytes(2, "little")),)
            if self.count % 3 == 0 and self.accepts:
                self.accept(frozenset({max(self.accepts) ^ 1, 0x100}))
        if now_us >= self.beat_us:
            self.beat_us += self.period_us
            out = (CanFrame(0x100 + self.number % 3, bytes([self.number])), *out)
        return out

    def hears(self, frame: CanFrame) -> bool:
        if self.accepts is not None and frame.can_id not in self.accepts:
            return False
        self.heard.append(str(frame))
        if frame.can_id == SWITCH:
            self.accept(frozenset(can_id ^ 3 for can_id in self.accepts or ()) | {SWITCH})
        return True

    def accept(self, accepts: Accepted) -> None:
        self.accepts = accepts
        for told in self.on_accepts:
            told()


class Wrapper:
    """Around a device or a port; what it has not itself, it asks of that."""

    def __init__(self, inner: object) -> None:
        self._inner = inner

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)


class Unfiltered:
    """A device that does not say what it accepts: it hears everything."""

    tick_us = property(lambda self: self._node.tick_us)
    due_us = property(lambda self: self._node.due_us)

    def __init__(self, node: Node) -> None:
        self._node = node
        self.reset, self.tick, self.bus_state = node.reset, node.tick, node.bus_state


nodes = st.lists(
    st.tuples(
        st.sampled_from((1_000, 2_000, 5_000)),
        st.sampled_from((3_000, 7_000, 20_000, NEVER)),
        st.sampled_from((0, 1_000, 10_000)),
        st.frozensets(st.sampled_from((0x100, 0x101, 0x102, 0x201, 0x202, 0x203)), max_size=3),
    ),
    min_size=1,
    max_size=5,
)
pokes = st.lists(st.tuples(st.integers(0, 9_000), st.integers(0, 4)), max_size=6)


def play(
    parts: list[tuple[int, int, int, frozenset[int]]],
    poked: list[tuple[int, int]],
    *,
    dense: bool = False,
    order: int = 1,
    filtered: bool = True,
) -> tuple[list[str], list[list[str]]]:
    """Run a network, poke devices between steps, and note all that can be seen."""
    wire = CanWire(bit_rate=125_000)
    log, host = Log(wire), wire.end()
    devices = [Node(n, *part) for n, part in enumerate(parts)]
    stations = [Station(n if filtered else Unfiltered(n), wire.end()) for n in devices]
    rig = Rig(*stations[::order], dense=dense)
    for wait_us, who in poked:
        rig.run_for(wait_us)
        devices[who % len(devices)].answer_us = rig.now_us
        host.send(rig.now_us, frames(" ".join(BURST[: 1 + who])))
    rig.run_for(60_000)
    wire.advance(rig.now_us)
    return log.lines, [device.heard for device in devices]


@settings(deadline=None)
@given(nodes, pokes)
def test_dense_and_sparse_runs_are_the_same(
    parts: list[tuple[int, int, int, frozenset[int]]], poked: list[tuple[int, int]]
) -> None:
    assert play(parts, poked) == play(parts, poked, dense=True)


@settings(deadline=None)
@given(nodes, pokes)
def test_filtered_and_unfiltered_runs_are_the_same(
    parts: list[tuple[int, int, int, frozenset[int]]], poked: list[tuple[int, int]]
) -> None:
    assert play(parts, poked) == play(parts, poked, filtered=False)


@settings(deadline=None)
@given(nodes, pokes)
def test_the_order_of_listing_makes_no_difference(
    parts: list[tuple[int, int, int, frozenset[int]]], poked: list[tuple[int, int]]
) -> None:
    assert play(parts, poked) == play(parts, poked, order=-1)


def test_a_node_that_does_not_accept_a_frame_is_not_ticked() -> None:
    wire = CanWire()
    deaf, keen = Node(1), Node(2, accepts=frozenset({0x80}))
    host = wire.end()
    rig = Rig(Station(deaf, wire.end()), Station(keen, wire.end()))
    host.send(0, frames("080#"))
    rig.run_for(100_000)
    assert (deaf.ticks, keen.ticks) == ([], [1_000, 4_000])
    assert host.poll(100_000) == frames("202#0100")


def test_a_wrapper_with_getattr_is_treated_as_what_it_wraps() -> None:
    """Python 3.12 and later do not call `__getattr__` where a protocol is asked for."""
    wire = CanWire()
    node, end, host = Node(1, period_us=10_000), wire.end(), wire.end()
    wrapped: Any = Wrapper(node), Wrapper(end)
    rig = Rig(Station(*wrapped))
    host.send(0, frames("080#"))
    rig.run_to(5_000)
    assert node.ticks == []
    wire.disconnect(end)
    rig.run_to(50_000)
    assert node.state is ErrorState.PASSIVE


def test_a_frame_that_ends_at_a_tick_is_heard_in_it() -> None:
    wire = CanWire()
    node, host = Node(1, accepts=None), wire.end()
    rig = Rig(Station(node, wire.end()))
    rig.run_to(1_000 - 55)
    host.send(rig.now_us, frames("705#7F"))
    rig.run_to(1_000)
    assert node.ticks == [1_000]


def test_what_is_done_to_a_device_between_steps_is_noticed() -> None:
    wire = CanWire()
    node, host = Node(1), wire.end()
    rig = Rig(Station(node, wire.end()))
    rig.run_to(5_500)
    node.answer_us = 0
    assert rig.next_us == 6_000
    rig.run_to(10_000)
    assert (node.ticks, host.poll(10_000)) == ([6_000], frames("201#0100"))
    node.answer_us = 50_000
    rig.run_to(20_000)
    node.answer_us = 30_000
    assert rig.run_until(lambda: node.count == 2, timeout_us=100_000)
    assert rig.now_us == 30_000


def test_a_device_that_was_due_and_is_so_no_longer_is_not_ticked() -> None:
    wire = CanWire()
    node, _ = Node(1, period_us=10_000), wire.end()
    rig = Rig(Station(node, wire.end()))
    assert rig.next_us == 10_000
    node.beat_us = 30_000
    rig.run_to(40_000)
    assert node.ticks == [30_000, 40_000]


def test_a_step_goes_to_the_end_of_a_frame_even_if_nobody_listens() -> None:
    wire = CanWire()
    log, node, _ = Log(wire), Node(1, period_us=10_000), wire.end()
    rig = Rig(Station(node, wire.end()))
    rig.step()
    assert (rig.now_us, log.lines) == (10_000, [])
    rig.step()
    assert log.lines == [f"{rig.now_us} 101#01"]


def test_two_wires_are_kept_in_step() -> None:
    fast, slow = CanWire(), CanWire(bit_rate=10_000)
    near, far = Node(1, accepts=None, delay_us=0), Node(2, accepts=None, delay_us=0)
    log, hosts = Log(slow), (fast.end(), slow.end())
    rig = Rig(Station(near, fast.end()), Station(far, slow.end()))
    hosts[0].send(0, frames("001#"))
    hosts[1].send(0, frames("001#"))
    rig.run_for(100_000)
    assert near.ticks == [1_000]
    assert hosts[0].poll(100_000) == frames("201#0100")
    assert far.ticks == [5_000]
    assert [text.split()[1] for text in log.lines] == ["001#", "202#0100"]


class Clock:
    """A clock that notes what it was asked for."""

    def __init__(self) -> None:
        self.asked = list[int]()

    def wait_until(self, t_us: int, /) -> int:
        self.asked.append(t_us)
        return 0


def test_in_real_time_the_rig_wakes_at_each_tick_but_runs_only_those_with_work() -> None:
    wire, clock = CanWire(), Clock()
    node, idle = Node(1, period_us=3_000, accepts=frozenset({0x80})), Node(2)
    host = wire.end()
    rig = Rig(Station(node, wire.end()), Station(idle, wire.end()), clock=clock)
    host.send(0, frames("080#"))
    rig.run_for(6_000)
    assert clock.asked == [1_000, 2_000, 3_000, 4_000, 5_000, 6_000]
    assert (node.ticks, idle.ticks) == ([1_000, 3_000, 4_000, 6_000], [])


@pytest.mark.parametrize("dense", [False, True])
def test_a_device_hears_of_the_error_state_of_its_controller(dense: bool) -> None:
    wire = CanWire()
    node, end, host = Node(1, period_us=10_000), wire.end(), wire.end()
    rig = Rig(Station(node, end), dense=dense)
    wire.disconnect(end)
    rig.run_to(50_000)
    assert (node.state, node.count) == (ErrorState.PASSIVE, 1)
    wire.reconnect(end)
    rig.run_to(60_000)
    assert (node.state, len(host.poll(60_000))) == (ErrorState.ACTIVE, 7)


@pytest.mark.parametrize(("after_us", "ticks"), [(0, [10_000]), (1, [10_000, 11_000])])
def test_a_frame_that_ends_right_behind_a_tick_is_heard_in_the_next(
    after_us: int, ticks: list[int]
) -> None:
    wire = CanWire()
    node, host = Node(1, period_us=10_000, accepts=frozenset({0x705})), wire.end()
    rig = Rig(Station(node, wire.end()))
    host.send(10_000 - 55 + after_us, frames("705#7F"))
    rig.run_to(12_000)
    assert node.ticks == ticks


def test_a_device_may_tick_each_microsecond() -> None:
    wire = CanWire()
    node = Node(1, tick_us=1, accepts=None, delay_us=0)
    host, rig = wire.end(), Rig(Station(node, wire.end()))
    rig.run_to(10)
    node.answer_us = 11
    rig.run_to(20)
    host.send(20, frames("705#7F"))
    rig.run_to(200)
    assert node.ticks == [11, 135]


@dataclass
class Belt:
    """Lets a node send as soon as another has heard something."""

    first: Node
    second: Node
    tick_us: int = 1_000
    due_us: int = NEVER

    def act(self, now_us: int, /) -> None:
        if self.first.heard:
            self.first.heard.clear()
            self.second.answer_us = 0


@pytest.mark.parametrize("dense", [False, True])
def test_no_bus_is_ahead_of_a_tick_that_another_bus_brings(dense: bool) -> None:
    fast, slow = CanWire(), CanWire(bit_rate=10_000)
    near, far = Node(1, accepts=frozenset({0x80})), Node(2, accepts=frozenset({0x123}))
    log, hosts = Log(slow), (fast.end(), slow.end())
    stations = (Station(near, fast.end()), Station(far, slow.end()))
    rig = Rig(*stations, couplings=[Belt(near, far)], dense=dense)
    hosts[0].send(0, frames("080#"))
    hosts[1].send(0, frames("700# 701# 123#"))
    rig.run_to(100_000)
    assert log.text == "700# 202#0100 701# 123# 202#0200"
