"""A drive that works ahead is, to the bit, where one is that works tick by tick."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import sin
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tickrig.device.canopen.ds402.drive import Ds402
from tickrig.device.canopen.models import epos
from tickrig.device.canopen.slave import TICK_US, CanopenSlave, Nonvolatile, ServiceMaker
from tickrig.device.canopen.stack import make_slave
from tickrig.device.servo.parameters import EPOS_WHEEL
from tickrig.device.servo.servo import Servo
from tickrig.device.twin import Copyable, twin
from tickrig.emulators.bench.running_emulator import UNSEEN_US
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.node import Node
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.can import CanFrame, Frames

CYCLIC = {(0x6060, 0): 8, (0x1400, 1): 0x8000_0200, (0x1401, 2): 1, (0x1800, 2): 1}
"""Mode csp; targets and actual values go with SYNC."""

Step = tuple[int, str, tuple[Any, ...]]


class Master(Copyable):
    """Sends targets and SYNC in a cycle; what it has sent and heard is known."""

    def __init__(self, cycle_ms: int, swing: int, faster: float) -> None:
        self.tick_us, self.due_us = 1_000, 0
        self.cycle_us, self.swing, self.faster = 1_000 * cycle_ms, swing, faster
        self.controlword = 0x06
        self.received: list[tuple[int, str]] = []

    def reset(self) -> None:
        raise NotImplementedError

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        self.received += [(now_us, str(frame)) for frame in rx]
        if now_us < self.due_us:
            return ()
        self.due_us = now_us + self.cycle_us
        target = round(self.swing * sin(now_us / 1e6 * self.faster))
        data = self.controlword.to_bytes(2, "little") + target.to_bytes(4, "little", signed=True)
        return (CanFrame(0x080), CanFrame(0x301, data))


class Bench:
    """A drive with power and plug, and its master."""

    def __init__(
        self,
        master: Master,
        stored: dict[tuple[int, int], int],
        make: ServiceMaker = epos.make_application,
        *,
        dense: bool,
    ) -> None:
        wire, made, kept = CanWire(), epos.dictionary(), Nonvolatile()
        for at, value in {**CYCLIC, **stored}.items():
            kept.parameters[made[at].key] = made[at].data_type.encode(value)
        self.node = Node("drive", make_slave(made, 1, kept, make), wire)
        self.master = master
        stations = Station(self.node, self.node.port), Station(master, wire.end())
        self.rig = Rig(*stations, dense=dense)
        self.end = wire.end(frozenset())
        self.rig.run_for(2_000)  # it boots, and hears nothing before
        self.send("000#0101")
        for controlword in (0x06, 0x07, 0x0F):
            master.controlword = controlword
            self.rig.run_for(20_000)

    @property
    def drive(self) -> Ds402:
        return Ds402.of(self.node.slave)

    def send(self, *texts: str) -> None:
        self.end.send(self.rig.now_us, tuple(CanFrame.parse(text) for text in texts))

    def write(self, index: int, value: int, sub: int = 0) -> None:
        size = {8: 0x2F, 16: 0x2B, 32: 0x23}[epos.dictionary()[index, sub].data_type.bits]
        data = (value & 0xFFFF_FFFF).to_bytes(4, "little")
        request = bytes([size]) + index.to_bytes(2, "little") + bytes([sub]) + data
        self.end.send(self.rig.now_us, (CanFrame(0x601, request),))

    def input(self, name: str, value: float) -> None:
        self.node.inputs.set(name, value)

    def signal(self, name: str, value: float) -> None:
        signal = self.node.signal(name)
        assert signal is not None
        signal.write(value)

    def order(self, controlword: int) -> None:
        self.master.controlword = controlword

    def later(self, delay_us: int, name: str, value: float) -> None:
        at_us = self.rig.now_us + delay_us
        self.rig.event_queue.put((name, at_us), at_us, partial(self._set, name, value))

    def _set(self, name: str, value: float, now_us: int) -> None:
        self.signal(name, value)

    def look(self) -> object:
        """Return all that is to be seen, and what is inside."""
        node, motor = self.node, self.drive.axis.motor
        reference, plant = self.drive.axis.reference, motor._plant  # type: ignore[union-attr]
        return (
            [node.read(name) for name in node.outputs],
            [entry.present() for entry in node.slave.dictionary if entry.index >= 0x2000],
            (plant.position, plant.speed_rad_s, plant.current_a, plant.losses),
            (motor.counts, motor.current_limited, motor.resting, self.drive.limited),
            (reference.position, reference.velocity, reference.current_a, self.drive.axis.zero),
            self.master.received,
        )

    def play(self, steps: list[Step], unseen_us: int = 0) -> list[object]:
        seen = []
        for pause_us, verb, what in steps:
            getattr(self, verb)(*what)
            self.go_on(pause_us, unseen_us)
            seen.append(self.look())
        return seen

    def go_on(self, pause_us: int, unseen_us: int) -> None:
        """Let time pass; in real time tick by tick, and how long nobody looks is a guess."""
        end_us = self.rig.now_us + pause_us
        while unseen_us and self.rig.now_us + TICK_US < end_us:
            self.rig.run_to(self.rig.now_us + TICK_US, unseen_us=unseen_us)
        self.rig.run_to(end_us, unseen_us=unseen_us)


FAULTS = ("shaft_blocked", "motor_phase_open", "encoder_unplugged", "short_circuit", "power_off")
SWITCHES = ("positive_limit_switch", "negative_limit_switch")
OBJECTS = [
    *((0x6060, 0, mode) for mode in (8, 8, 1, 3, 7, 9, 10, -1)),
    *((0x6065, 0, window) for window in (5, 60, 2_000, 0xFFFF_FFFF)),
    *((0x6066, 0, wait_ms) for wait_ms in (0, 7, 100)),
    *((0x60C2, 1, period_ms) for period_ms in (1, 10, 25)),
    *((0x6072, 0, per_mille) for per_mille in (20, 300, 2_900)),
    *((0x607D, 1, -900), (0x607D, 2, 700), (0x607F, 0, 200), (0x607F, 0, 25_000)),
    *((0x607E, 0, 0xC0), (0x607E, 0, 0), (0x60B0, 0, 50), (0x60B1, 0, 40), (0x605A, 0, 6)),
    *((0x6040, 0, 0x02), (0x1800, 2, 255), (0x1800, 2, 1), (0x1801, 1, 0x281), (0x6007, 0, 3)),
]
WORDS = st.sampled_from([0x06, 0x07, 0x0F, 0x0F, 0x0F, 0x02, 0x80, 0x00, 0x1F])
LOADS = st.tuples(st.just("load_nm"), st.floats(-4, 4))
SUPPLIES = st.tuples(st.just("supply_v"), st.sampled_from([24.0, 24.0, 12.0, 8.0, 40.0]))
INERTIAS = st.tuples(st.just("load_kg_m2"), st.floats(0, 0.05))
AIRS = st.tuples(st.just("ambient_c"), st.floats(-40, 85))
HANDS = st.tuples(st.sampled_from(FAULTS + SWITCHES), st.integers(0, 1))
ANGLES = st.tuples(st.just("positive_limit_at"), st.floats(-5, 40))
INPUTS = LOADS | SUPPLIES | INERTIAS | AIRS | HANDS | ANGLES
FRAMES = st.sampled_from(
    [
        *("080#", "000#0101", "000#0201", "000#8101", "000#8201", "601#4041600000000000"),
        *("601#4064600000000000", "601#407D600000000000", "301#0F0020030000"),
        "201#0F0000000000",
    ]
)
PAUSES_US = st.integers(0, 120_000) | st.sampled_from([1_000, 10_000, 50_000, 300_000])
ACTIONS: st.SearchStrategy[tuple[str, tuple[Any, ...]]] = st.one_of(
    INPUTS.map(lambda pair: ("signal", pair)),
    st.tuples(st.integers(1, 50_000), INPUTS).map(lambda two: ("later", (two[0], *two[1]))),
    st.sampled_from(OBJECTS).map(lambda row: ("write", (row[0], row[2], row[1]))),
    WORDS.map(lambda word: ("order", (word,))),
    FRAMES.map(lambda text: ("send", (text,))),
)
STEPS = st.lists(st.tuples(PAUSES_US, ACTIONS).map(lambda two: (two[0], *two[1])), max_size=12)
MASTERS = st.tuples(
    st.sampled_from([1, 3, 10, 10, 10, 20, 47]),
    st.sampled_from([40, 900, 4_000, 60_000]),
    st.floats(0.1, 12),
)
STORED = st.dictionaries(
    st.sampled_from([(0x60C2, 1), (0x6066, 0)]), st.sampled_from([1, 10, 40]), max_size=2
)


MIDWAY = [(61_000, "later", (14_500, "load_nm", 0.01 * n)) for n in range(1, 6)]
AT_REST = [(500_000, "signal", ("load_nm", load_nm)) for load_nm in (0.3, -0.3, 0.0)]


@pytest.mark.parametrize(
    ("master", "steps"),
    [
        ((10, 4_000, 6.28), MIDWAY),
        ((47, 900, 1.0), AT_REST),
        ((1, 40, 0.25), [(50_000, "order", (0x0F,))]),
    ],
    ids=["midway", "at rest", "each tick"],
)
def test_a_load_makes_no_difference(master: tuple[int, int, float], steps: list[Step]) -> None:
    ahead, plain = (Bench(Master(*master), {}, dense=dense) for dense in (False, True))
    guessing = Bench(Master(*master), {}, dense=False)
    assert ahead.play(steps) == plain.play(steps) == guessing.play(steps, UNSEEN_US)


def test_a_tpdo_that_is_switched_on_follows_each_change() -> None:
    steps: list[Step] = [
        (10_000, "later", (4_744, "supply_v", 24.0)),
        (300_000, "write", (0x1801, 0x281, 1)),
    ]
    ahead, plain = (Bench(Master(10, 60_000, 0.1), {}, dense=dense) for dense in (False, True))
    assert ahead.play(steps, UNSEEN_US) == plain.play(steps, UNSEEN_US)


@pytest.mark.unmeasured
@settings(max_examples=60, deadline=None)
@given(MASTERS, STORED, STEPS)
def test_working_ahead_makes_no_difference(
    master: tuple[int, int, float], stored: dict[tuple[int, int], int], steps: list[Step]
) -> None:
    ahead, plain = (Bench(Master(*master), stored, dense=dense) for dense in (False, True))
    guessing = Bench(Master(*master), stored, dense=False)
    assert ahead.play(steps) == plain.play(steps) == guessing.play(steps, UNSEEN_US)


@pytest.mark.unmeasured
@settings(max_examples=15, deadline=None)
@given(MASTERS, STEPS, STEPS, st.integers(1, 60_000))
def test_a_copy_made_while_a_drive_is_ahead_goes_on_as_it_does(
    master: tuple[int, int, float], before: list[Step], after: list[Step], at_us: int
) -> None:
    bench, plain = (Bench(Master(*master), {}, dense=dense) for dense in (False, True))
    for each in (bench, plain):
        each.play(before)
    copied: list[Bench] = []
    at_us = bench.rig.now_us + at_us
    bench.rig.event_queue.put("copy", at_us, lambda now_us: copied.append(twin(bench)))
    for each in (bench, plain):
        each.rig.run_for(60_000)
    (copy,) = copied
    copy.rig.event_queue.drop("copy")
    copy.rig.run_to(bench.rig.now_us)
    assert copy.look() == bench.look() == plain.look()
    assert copy.play(after) == bench.play(after) == plain.play(after)


class Counted(epos.Epos):
    """It counts the ticks in which it has work."""

    worked = 0

    def on_execute(self, now_us: int) -> None:
        self.worked += 1
        super().on_execute(now_us)


def make_counted(node: CanopenSlave, slot: int) -> Counted:
    return Counted(node, slot, Servo(EPOS_WHEEL))


def ticks(bench: Bench, run: Callable[[], object]) -> int:
    """Count in how many ticks a drive has work."""
    drive = Counted.of(bench.node.slave)
    before = drive.worked
    run()
    return drive.worked - before


@pytest.fixture
def swinging() -> Bench:
    bench = Bench(Master(10, 4_000, 6.28), {}, make_counted, dense=False)
    bench.rig.run_for(1_000_000)
    return bench


def test_a_drive_in_csp_has_work_with_each_sync_alone(swinging: Bench) -> None:
    assert ticks(swinging, lambda: swinging.rig.run_for(1_000_000)) < 150


def test_it_works_ahead_in_real_time_too(swinging: Bench) -> None:
    assert ticks(swinging, lambda: swinging.go_on(1_000_000, UNSEEN_US)) < 150


def test_it_works_ahead_after_an_action_too(swinging: Bench) -> None:
    swinging.rig.event_queue.wake("action", swinging.rig.now_us + 5_000)
    assert ticks(swinging, lambda: swinging.rig.run_for(1_000_000)) < 150


def test_who_waits_for_something_sees_each_tick(swinging: Bench) -> None:
    seen: list[float | str] = []

    def done() -> bool:
        seen.append(swinging.node.read("shaft_deg"))
        return False

    assert ticks(swinging, lambda: swinging.rig.run_until(done, 100_000)) == 100
    assert len(set(seen)) == 101


def test_a_watcher_sees_each_tick(swinging: Bench) -> None:
    seen: list[float | str] = []
    swinging.rig.watchers.append(lambda now_us: seen.append(swinging.node.read("shaft_deg")))
    swinging.rig.run_for(100_000)
    assert len(set(seen)) == 100
