from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.device.canopen.motor_core_unit.bench import UnitBench
from tests.soak import examples
from tickrig.device.canopen.models.motor_core_unit import INPUTS
from tickrig.device.physical import SignalType
from tickrig.wire.can import CanFrame

pytestmark = pytest.mark.unmeasured

OBJECTS = (0x1016, 0x1017, 0x1029, 0x2000, 0x2010, 0x2011, 0x6411, 0x6443, 0x6444)


class DenseBench(UnitBench):
    """Visits every tick."""

    def pass_ms(self, ms: int) -> None:
        for _ in range(ms):
            self.send()


@st.composite
def frames(draw: st.DrawFn) -> str:
    """Draw NMT commands, RPDO2, heartbeats, downloads."""
    kind = draw(st.integers(0, 5))
    if kind == 0:
        return f"000#{draw(st.sampled_from((0x01, 0x02, 0x80, 0x81, 0x82))):02X}20"
    if kind == 1:
        return str(CanFrame(0x320, draw(st.binary(min_size=8, max_size=8))))
    if kind == 2:
        return "77F#05"
    if kind == 3:
        return f"620#2F002000{draw(st.integers(0, 4)):02X}000000"
    at = draw(st.sampled_from(OBJECTS)).to_bytes(2, "little") + bytes([draw(st.integers(0, 3))])
    return str(CanFrame(0x620, b"\x22" + at + draw(st.binary(min_size=4, max_size=4))))


@st.composite
def input_changes(draw: st.DrawFn) -> tuple[str, float]:
    """Draw what the world does."""
    item = draw(st.sampled_from(INPUTS))
    if item.type is SignalType.FAULT:
        return item.name, draw(st.integers(0, 1))
    return item.name, draw(st.floats(item.low, item.high))


things = st.lists(st.tuples(st.integers(1, 400), st.one_of(frames(), input_changes())), max_size=12)


def play(bench: UnitBench, wanted: list[tuple[int, str | tuple[str, float]]]) -> UnitBench:
    bench.send("000#0120")
    bench.send("620#2F00200003000000")
    for wait_ms, thing in wanted:
        if isinstance(thing, str):
            bench.send(thing)
        else:
            bench.set(*thing)
        bench.pass_ms(wait_ms)
    return bench


def told(bench: UnitBench) -> list[object]:
    names = [*bench.unit.outputs]
    return [bench.log, bench.status, *map(bench.unit.read, names)]


@settings(deadline=None, max_examples=examples(25))
@given(things)
def test_dense_and_sparse_runs_are_the_same(
    wanted: list[tuple[int, str | tuple[str, float]]],
) -> None:
    assert told(play(UnitBench(), wanted)) == told(play(DenseBench(), wanted))


@settings(deadline=None)
@given(things)
def test_the_unit_never_raises_and_always_answers(
    wanted: list[tuple[int, str | tuple[str, float]]],
) -> None:
    bench = play(UnitBench(), wanted)
    bench.send("000#8020")
    bench.send("620#4000100000000000")
    bench.pass_ms(2)
    assert "5A0#4300100091010C00" in bench.heard
