from __future__ import annotations

from dataclasses import dataclass

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.device.canopen.pdo_bench import PdoBench, u8, u32, u64
from tickrig.device.canopen.slave import TICK_US
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.canopen.pdo import Dispatched, Scanned

pytestmark = pytest.mark.unmeasured

CAN_IDS = st.one_of(
    st.sampled_from((0x000, 0x080, 0x0B0, 0x185, 0x205, 0x285, 0x305, 0x405, 0x505)),
    st.integers(0, 0x7FF),
)
FRAMES = st.builds(
    CanFrame, CAN_IDS, st.binary(max_size=8), st.booleans(), st.sampled_from((False, False, True))
)
COB_IDS = st.sampled_from((0x205, 0x185, 0x8000_0205, 0x8000_0185, 0x4000_0080, 0x80, 0xB0))
MAPPED = st.sampled_from((0x2000_0008, 0x2003_0040, 0x200C_0101, 0x0005_0008, 0x2001_0007, 0))


@dataclass(frozen=True)
class Write:
    """A write over the bus."""

    index: int
    sub: int
    value: int


PARAMETERS = st.one_of(
    st.builds(Write, st.sampled_from((0x1400, 0x1401, 0x1800, 0x1801)), st.just(1), COB_IDS),
    st.builds(
        Write,
        st.sampled_from((0x1400, 0x1401, 0x1800, 0x1801)),
        st.sampled_from((2, 5)),
        st.sampled_from((0, 1, 2, 10, 240, 252, 253, 254, 255)),
    ),
    st.builds(Write, st.just(0x1800), st.sampled_from((3, 6)), st.integers(0, 240)),
    st.builds(
        Write,
        st.sampled_from((0x1600, 0x1601, 0x1A00, 0x1A01)),
        st.just(0),
        st.sampled_from((0, 1, 2, 8, 254, 255)),
    ),
    st.builds(Write, st.sampled_from((0x1600, 0x1601, 0x1A00, 0x1A01)), st.integers(1, 8), MAPPED),
    st.builds(Write, st.just(0x1005), st.just(0), COB_IDS),
    st.builds(Write, st.just(0x1006), st.just(0), st.sampled_from((0, 500, 1_000, 7_300))),
    st.builds(Write, st.just(0x1007), st.just(0), st.sampled_from((0, 1_000))),
    st.builds(Write, st.just(0x1019), st.just(0), st.integers(0, 255)),
    st.builds(Write, st.just(0x2000), st.just(0), st.integers(0, 255)),
)
STEPS = st.lists(st.one_of(st.lists(FRAMES, max_size=4).map(tuple), PARAMETERS), max_size=60)


def make_bench() -> PdoBench:
    return PdoBench(
        u8(0x1FA0, 0, 1),
        u32(0x1FA0, 1, Scanned(0x2000, 0, block=3).encode()),
        u8(0x1FD0, 0, 1),
        u64(0x1FD0, 1, Dispatched(0, 0, 0, 0x6200, 1, block=2).encode()),
    )


def play(steps: list[Frames | Write], *, sparse: bool) -> list[tuple[int, Frames]]:
    """Run the steps three ticks apart; return what was sent and when."""
    bench = make_bench()
    slave, sent = bench.slave, []
    slave.tick(2 * TICK_US, (CanFrame(0, b"\x01\x05"),))
    for number, step in enumerate(steps, 1):
        begin_us = 3 * TICK_US * number
        rx: Frames = ()
        if isinstance(step, Write):
            bench.write(step.index, step.sub, step.value)
        else:
            rx = step
        for now_us in range(begin_us, begin_us + 3 * TICK_US, TICK_US):
            if rx or not sparse or slave.due_us <= now_us:
                out = slave.tick(now_us, rx)
                rx = ()
                if out:
                    sent.append((now_us, out))
    return sent


@given(STEPS)
@settings(deadline=None)
def test_noise_never_raises_and_left_out_idle_ticks_are_not_visible(
    steps: list[Frames | Write],
) -> None:
    assert play(steps, sparse=True) == play(steps, sparse=False)


@given(STEPS)
@settings(deadline=None)
def test_a_node_obeys_after_noise(steps: list[Frames | Write]) -> None:
    bench = make_bench()
    bench.operational()
    for step in steps:
        if not isinstance(step, Write):
            bench.slave.tick(bench.now_us, step)
    assert bench.step("000#8105")[-1:] == ["705#00"]
