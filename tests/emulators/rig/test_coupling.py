"""Devices that are joined beside their wires: order and density must not be seen."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Coupling, Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.control.clock import RealClock
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER


@dataclass
class Cart:
    """Rolls as it is pushed."""

    push: int = 0
    speed: int = 0
    place: int = 0
    tick_us: int = 1_000

    @property
    def due_us(self) -> int:
        return 0 if self.push or self.speed else NEVER

    def reset(self) -> None:
        self.speed = 0

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        self.speed += self.push
        self.place += self.speed
        return ()


@dataclass
class Spring:
    """Pulls two carts together, and is strained at a time."""

    left: Cart
    right: Cart
    strained_us: int = NEVER
    tick_us: int = 1_000
    acted: list[int] = field(default_factory=list)

    @property
    def due_us(self) -> int:
        return self.strained_us

    def act(self, now_us: int, /) -> None:
        self.acted.append(now_us)
        if now_us >= self.strained_us:
            self.strained_us = NEVER
            self.left.place -= 20
        gap = self.right.place - self.left.place - 10
        pull = (gap > 0) - (gap < 0)
        self.left.push, self.right.push = pull, -pull


@dataclass
class Bench:
    """Two carts, a spring, and a rig."""

    strained_us: int = NEVER
    swapped: bool = False
    dense: bool = False

    def __post_init__(self) -> None:
        wire = CanWire()
        self.left, self.right = Cart(), Cart(place=10)
        self.spring = Spring(self.left, self.right, self.strained_us)
        carts = (self.right, self.left) if self.swapped else (self.left, self.right)
        stations = [Station(cart, wire.end()) for cart in carts]
        self.rig = Rig(*stations, couplings=[self.spring], dense=self.dense)

    def run(self, duration_us: int) -> tuple[int, ...]:
        self.rig.run_for(duration_us)
        return (self.left.place, self.left.speed, self.right.place, self.right.speed)


@given(
    st.sampled_from((NEVER, 0, 1_500, 20_000)),
    st.lists(st.tuples(st.integers(0, 30_000), st.integers(-2, 2)), max_size=6),
)
def test_neither_order_nor_density_is_seen(strained_us: int, pushes: list[tuple[int, int]]) -> None:
    def places(*, swapped: bool, dense: bool) -> list[tuple[int, ...]]:
        bench = Bench(strained_us, swapped, dense)
        seen = []
        for duration_us, push in pushes:
            bench.left.place += push
            bench.spring.strained_us = min(bench.spring.strained_us, bench.rig.now_us)
            seen.append(bench.run(duration_us))
        return [*seen, bench.run(50_000)]

    both = (False, True)
    first, *others = [places(swapped=x, dense=y) for x in both for y in both]
    assert all(places == first for places in others)


def test_a_rig_in_which_nothing_moves_passes_over_its_couplings() -> None:
    bench = Bench()
    bench.run(1_000_000)
    assert bench.spring.acted == []


def test_a_coupling_that_is_due_wakes_the_rig_and_the_devices() -> None:
    bench = Bench(strained_us=19_500)
    bench.run(20_000)
    assert (bench.spring.acted, bench.left.place) == ([20_000], -20)
    assert bench.run(1_000) == (-19, 1, 9, -1)
    assert bench.spring.acted == [20_000, 21_000]


def test_a_coupling_acts_on_its_own_grid() -> None:
    bench = Bench(strained_us=0)
    bench.spring.tick_us = 5_000
    bench.run(12_000)
    assert bench.spring.acted == [5_000, 10_000]


@pytest.mark.realtime
def test_a_coupling_acts_in_real_time() -> None:
    left, right = Cart(), Cart(place=10)
    spring: Coupling = Spring(left, right, strained_us=0)
    wire = CanWire()
    stations = [Station(left, wire.end()), Station(right, wire.end())]
    Rig(*stations, couplings=[spring], clock=RealClock()).run_for(10_000)
    virtual = Bench(strained_us=0)
    assert virtual.run(10_000)[0] == left.place
