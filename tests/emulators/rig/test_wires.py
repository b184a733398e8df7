"""Several wires of a rig: each goes as if it were alone, and nobody notices who was asked first."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.emulators.can.can_bench import Log, frames
from tests.emulators.can.test_can_rig import Node
from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.can import CanFrame
from tickrig.wire.instant import NEVER

RATES = (1_000_000, 125_000, 10_000)
END_US = 60_000

Part = tuple[int, int, int, frozenset[int]]
Act = tuple[int, int, str]
"""After so many us, on this bus: frames that are sent, or what else is done."""

parts = st.tuples(
    st.sampled_from((1_000, 2_000, 5_000)),
    st.sampled_from((3_000, 20_000, NEVER)),
    st.sampled_from((0, 1_000, 10_000)),
    st.frozensets(st.sampled_from((0x100, 0x101, 0x102, 0x200, 0x201)), max_size=3),
)
buses = st.lists(st.lists(parts, max_size=3), min_size=2, max_size=4)
acts = st.lists(
    st.tuples(
        st.integers(0, 7_000),
        st.integers(0, 3),
        st.sampled_from(("100#01", "101#", "102# 200# 201#0203", "pull", "plug", "short", "clear")),
    ),
    max_size=8,
)


class Bus:
    """A bus with nodes, a host, and what was seen of it."""

    def __init__(self, number: int, nodes: list[Part], *, observed: bool = True) -> None:
        self.wire = CanWire(RATES[number % len(RATES)])
        self.log, self.host = Log(self.wire), self.wire.end()
        self.nodes = [Node(place, *part) for place, part in enumerate(nodes)]
        self.ends = [self.wire.end() for _ in self.nodes]
        self.loads = list[int]()
        if not observed:
            self.wire.observers.clear()

    @property
    def stations(self) -> list[Station[tuple[CanFrame, ...]]]:
        return [Station(node, end) for node, end in zip(self.nodes, self.ends, strict=True)]

    def act(self, what: str, now_us: int) -> None:
        self.loads.append(self.wire.load_permille(5_000))
        match what:
            case "pull":
                self.wire.disconnect(self.host)
            case "plug":
                self.wire.reconnect(self.host)
            case "short":
                self.wire.faults.arm("short")
            case "clear":
                self.wire.faults.clear("short")
            case _:
                self.host.send(now_us, frames(what))

    def seen(self) -> list[object]:
        self.loads.append(self.wire.load_permille())
        heard = [(node.heard, node.count) for node in self.nodes]
        return [heard, self.loads, self.wire.due_us, self.wire.bus.now_us]

    def all_seen(self) -> list[object]:
        return [self.log.lines, [node.ticks for node in self.nodes], *self.seen()]


def enter(rig: Rig, made: list[Bus], played: list[Act]) -> None:
    """Enter what is done, by the number of the bus; those that are not there do nothing."""
    at_us = 0
    for place, (after_us, number, what) in enumerate(played):
        at_us += after_us
        if number < len(made):
            rig.event_queue.put(place, at_us, partial(made[number].act, what))


def run(made: list[Bus], played: list[Act], *, dense: bool = False) -> None:
    rig = Rig(*(station for bus in made for station in bus.stations), dense=dense)
    for bus in made:
        rig.move_on(bus.wire)
    enter(rig, made, played)
    rig.run_to(END_US)


@settings(deadline=None)
@given(buses, acts)
def test_each_bus_goes_as_if_it_were_alone(nodes: list[list[Part]], played: list[Act]) -> None:
    together = [Bus(number, each) for number, each in enumerate(nodes)]
    run(together, played)
    for number, each in enumerate(nodes):
        alone = Bus(number, each)
        run([alone], [(after_us, 0 if on == number else 9, what) for after_us, on, what in played])
        assert together[number].all_seen() == alone.all_seen()


@settings(deadline=None)
@given(buses, acts)
def test_what_observers_hear_is_in_the_order_of_time_and_of_joining(
    nodes: list[list[Part]], played: list[Act]
) -> None:
    made, heard = [Bus(number, each) for number, each in enumerate(nodes)], list[tuple[int, int]]()

    def hear(place: int, at_us: int, _: object) -> None:
        heard.append((at_us, place))

    joined = sorted(made, key=lambda bus: not bus.nodes)  # stations bring their bus along
    for place, bus in enumerate(joined):
        bus.wire.observers.append(partial(hear, place))
    run(made, played)
    assert heard == sorted(heard)


@settings(deadline=None)
@given(buses, acts)
def test_nobody_notices_whether_there_are_observers(
    nodes: list[list[Part]], played: list[Act]
) -> None:
    made = [Bus(number, each) for number, each in enumerate(nodes)]
    silent = [Bus(number, each, observed=False) for number, each in enumerate(nodes)]
    run(made, played)
    run(silent, played, dense=True)
    assert [bus.seen() for bus in made] == [bus.seen() for bus in silent]


@dataclass
class Gateway:
    """Hands on what a bus brings to the next bus, when it has arrived."""

    ends: list[CanEnd]
    handed_on: list[tuple[int, int, str]] = field(default_factory=list)

    def look(self, now_us: int) -> None:
        for place, end in enumerate(self.ends):
            for at_us, frame in end.poll_stamped(now_us):
                self.handed_on.append((now_us, at_us, str(frame)))
                onward = CanFrame(frame.can_id & 0x700 | 0x0A0 | place, frame.data)
                if frame.can_id & 0x0A0 != 0x0A0:
                    self.ends[place - 1].send(now_us, (onward,))


@settings(deadline=None)
@given(buses, acts)
def test_a_host_between_buses_hands_on_when_a_frame_has_ended(
    nodes: list[list[Part]], played: list[Act]
) -> None:
    seen = []
    for dense in (False, True):
        made = [Bus(number, each) for number, each in enumerate(nodes)]
        rig = Rig(*(station for bus in made for station in bus.stations), dense=dense)
        gateway = Gateway([bus.wire.end() for bus in made])
        rig.hosts.extend(gateway.ends)
        rig.watchers.append(gateway.look)
        for bus in made:
            rig.move_on(bus.wire)
        enter(rig, made, played)
        rig.run_to(END_US)
        assert all(now_us == at_us for now_us, at_us, _ in gateway.handed_on)
        seen.append([gateway.handed_on, *((bus.log.lines, bus.seen()) for bus in made)])
    assert seen[0] == seen[1]


def test_wires_on_which_nothing_is_are_not_asked() -> None:
    asked = list[int]()

    class Asked(CanWire):
        """Notes that it was asked."""

        def advance_until_received(self, until_us: int) -> bool:
            asked.append(until_us)
            return super().advance_until_received(until_us)

        def advance(self, now_us: int) -> None:
            asked.append(now_us)
            super().advance(now_us)

    busy, idle = CanWire(), [Asked() for _ in range(5)]
    node = Node(1, period_us=3_000)
    rig = Rig(Station(node, busy.end()), *(Station(Node(2), wire.end()) for wire in idle))
    hosts = [busy.end(), *(wire.end() for wire in idle)]
    rig.run_to(1_000)
    asked.clear()
    rig.run_to(END_US)
    assert len(node.ticks) == END_US // 3_000
    assert asked == [END_US] * len(idle)
    hosts[3].send(rig.now_us, frames("100#"))
    rig.run_to(END_US + 10_000)
    assert len(asked) > len(idle)
    assert hosts[0].poll(rig.now_us)
