"""The kernel in C and the Python bus do the same, to the bit, and either goes on for the other."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Iterator
from itertools import cycle
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tickrig
from tests.emulators.can.can_bench import some_frames
from tests.soak import examples
from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig import kernel
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.can import CanFrame, ErrorFrame, Frames, frame_bits
from tickrig.wire.instant import NEVER

pytestmark = pytest.mark.skipif(not tickrig.kernel, reason="the kernel was not built")

BIT_RATES = (10_000, 125_000, 83_333, 500_000, 1_000_000)
MOST_NODES = 4


@pytest.fixture(autouse=True)
def enabled_again() -> Iterator[None]:
    yield
    kernel.enable(True)


class Node:
    """Answers what it hears, sends bursts when they are due; its filter and period differ."""

    def __init__(self, number: int, tick_us: int, bursts: dict[int, Frames]) -> None:
        self.tick_us, self.number = tick_us, number
        self.accepts = None if number % 3 == 0 else frozenset(range(number, 0x800, 2))
        self.reconfigured_by = frozenset(range(0, 0x800, 5)) if number % 2 else frozenset[int]()
        self.on_accepts: list[object] = []
        self.bursts = sorted(bursts.items())
        self.heard: list[tuple[int, str]] = []

    @property
    def due_us(self) -> int:
        return self.bursts[0][0] if self.bursts else NEVER

    def reset(self) -> None:
        self.heard.clear()

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        self.heard += [(now_us, str(frame)) for frame in rx]
        out: Frames = ()
        if rx and not rx[0].can_id % 4:
            out = (CanFrame(0x580 + self.number, bytes(rx[0].data)),)
        while self.bursts and self.bursts[0][0] <= now_us:
            out += self.bursts.pop(0)[1]
        return out


bursts = st.dictionaries(
    st.integers(0, 30_000), st.lists(some_frames(), max_size=4).map(tuple), max_size=6
)
nodes = st.lists(
    st.tuples(st.sampled_from((500, 1_000, 3_000)), bursts), min_size=1, max_size=MOST_NODES
)
FAULTS = ("drop", "corrupt", "duplicate", "delay", "babble", "short")
acts = st.tuples(
    st.integers(1, 20_000),
    st.sampled_from(
        (
            "run",
            "run",
            "send",
            "send",
            "arm",
            "clear",
            "pull",
            "plug",
            "cut",
            "join",
            "watch",
            "put",
            "wait",
            "wait",
        )
    ),
    st.integers(0, MOST_NODES - 1),
    st.sampled_from(FAULTS),
    st.lists(some_frames(), max_size=3).map(tuple),
)
Act = tuple[int, str, int, str, Frames]


class Played:
    """A bus with nodes, and what was heard and done on it."""

    def __init__(self, bit_rate: int, made: list[tuple[int, dict[int, Frames]]]) -> None:
        self.wire = CanWire(bit_rate, seed=3)
        self.log: list[tuple[int, CanFrame | ErrorFrame]] = []
        self.watched: list[tuple[int, bool, int, int]] = []
        self.waited: list[tuple[int, Frames]] = []
        self.wire.observers.append(self.hear)
        ends = [self.wire.end() for _ in made]
        self.nodes = [Node(n, tick_us, its) for n, (tick_us, its) in enumerate(made)]
        self.rig = Rig(*map(Station, self.nodes, ends))
        self.host = self.wire.end()
        self.ends: list[CanEnd] = [*ends, self.host]

    def hear(self, at_us: int, received: CanFrame | ErrorFrame) -> None:
        self.log.append((at_us, received))

    def do(self, act: Act) -> None:
        after_us, what, number, fault, frames = act
        end = self.ends[number % len(self.ends)]
        match what:
            case "send":
                self.host.send(self.rig.now_us, frames)
            case "arm":
                rated = fault not in {"babble", "short"}
                self.wire.faults.arm(fault, *["0.3"] * rated)
            case "clear":
                for name in FAULTS:
                    self.wire.faults.clear(name)
            case "pull":
                self.wire.disconnect(end)
            case "plug":
                self.wire.reconnect(end)
            case "cut":
                self.wire.cut_power(end)
            case "watch":
                self.rig.watchers.append(self.watch)
            case "put":
                self.rig.event_queue.put(number, self.rig.now_us + after_us // 2, self.put)
            case "join":
                self.ends.append(self.wire.end(frozenset({0x100, 0x181})))
                self.wire.bus.recover(end, self.rig.now_us)
            case "wait":
                self.waited.append((self.rig.now_us, self.host.poll(self.rig.now_us)))
                self.host.send(self.rig.now_us, frames)
                self.rig.run_to(self.rig.now_us + after_us, self.host)
                self.waited.append((self.rig.now_us, self.host.inbox))
                return
        self.rig.run_for(after_us)

    def watch(self, now_us: int) -> None:
        """Look at the rig, and set something now and then."""
        self.watched.append((now_us, self.rig.in_step, self.rig.now_us, len(self.log)))
        if now_us % 7_000 == 0:
            self.nodes[0].bursts.insert(0, (now_us, (CanFrame(0x101, b"w"),)))
        if len(self.watched) > 40:
            self.rig.watchers.clear()

    def put(self, now_us: int) -> None:
        """Send what an action sends."""
        self.host.send(now_us, (CanFrame(0x1FF, now_us.to_bytes(4, "big")),))

    def seen(self) -> object:
        """Return all that can be seen, and the whole state."""
        ends = [(e.poll_stamped(self.rig.now_us), e.lost, e.controller.tec) for e in self.ends]
        heard = [node.heard for node in self.nodes]
        rest = self.wire.due_us, self.wire.load_permille(), self.rig.next_us
        return (
            self.log,
            self.watched,
            self.waited,
            heard,
            ends,
            rest,
            state_of(self.wire.bus),
            state_of(self.ends[0]),
        )


_PASSING = {"_sound", "next", "_first", "received"}
"""What holds for one call: the next `advance_until_received` sets `received`."""


def state_of(item: Any) -> dict[str, object]:
    """Return what a twin would begin with, of values that say themselves what they are."""
    slots = item.__getstate__()[1]
    plain = (int, bool, str, bytes, tuple, type(None))
    return {
        name: (type(value).__name__, value)
        for name, value in slots.items()
        if isinstance(value, plain) and name not in _PASSING
    }


@given(st.sampled_from(BIT_RATES), nodes, st.lists(acts, max_size=12), st.lists(st.booleans()))
@settings(max_examples=examples(60), deadline=None)
def test_kernel_and_python_do_the_same_and_go_on_for_each_other(
    bit_rate: int,
    made: list[tuple[int, dict[int, Frames]]],
    played: list[Act],
    switched: list[bool],
) -> None:
    seen = []
    for turns in ([False], [True], [*switched, True, False]):
        bus, turn = Played(bit_rate, made), cycle(turns)
        for act in [*played, (30_000, "run", 0, "", ())]:
            kernel.enable(next(turn))
            bus.do(act)
        seen.append(bus.seen())
    assert seen[0] == seen[1] == seen[2]


@given(some_frames())
def test_a_frame_has_as_many_bits_in_c(frame: CanFrame) -> None:
    assert kernel.bits(frame) == frame_bits(frame)


@pytest.mark.parametrize(
    "frame",
    [
        CanFrame(0x800),
        CanFrame(-1),
        CanFrame(1 << 70),
        CanFrame(0x2000_0000, extended=True),
        CanFrame(5, bytes(9)),
        CanFrame(5, bytes(100_000)),
        CanFrame(5, b"x", remote=True),
        CanFrame(5, remote=True, remote_length=1 << 66),
        CanFrame(5, remote_length=3),
        CanFrame(5, bytearray(3)),  # type: ignore[arg-type] # what a user may try
        CanFrame("5"),  # type: ignore[arg-type] # as this
        (5, b""),
        None,
    ],
)
def test_what_is_no_frame_is_left_to_python(frame: object) -> None:
    assert kernel.bits(frame) is None
    ended: list[object] = []
    for wanted in (True, False):
        kernel.enable(wanted)
        wire = CanWire()
        ends = [wire.end() for _ in range(2)]
        try:
            ends[0].send(0, (frame,))  # type: ignore[arg-type] # as above
            wire.advance(10_000)
            ended.append((ends[1].poll(10_000), wire.due_us))
        except Exception as error:
            ended.append((type(error), 0))
    assert ended[0] == ended[1]


def test_a_fork_a_snapshot_and_a_pickle_are_those_of_the_python_bus() -> None:
    made: list[tuple[int, dict[int, Frames]]] = [
        (1_000, {n * 700: (CanFrame(0x180 + n, bytes([n])),)}) for n in range(4)
    ]
    states, logs = [], []
    for wanted in (True, False):
        kernel.enable(wanted)
        bus = Played(500_000, made)
        bus.rig.run_for(1_234)
        bus.host.send(1_234, (CanFrame(0x100, b"\x01"), CanFrame(0x101, b"\x02")))
        bus.rig.run_for(150)
        pickled = pickle.dumps(bus.wire)
        snapshot = bus.rig.snapshot(bus.wire)
        twin = copy.deepcopy(bus.wire)
        states.append((len(pickled), state_of(twin.bus), state_of(pickle.loads(pickled).bus)))
        bus.rig.run_for(20_000)
        first = [node.heard[:] for node in bus.nodes]
        snapshot.restore()
        bus.rig.run_for(20_000)
        logs.append((first, [node.heard for node in bus.nodes]))
    assert states[0] == states[1]
    assert logs[0] == logs[1]
    assert logs[0][0] == logs[0][1]
