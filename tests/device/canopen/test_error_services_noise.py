"""Random traffic on the CAN-IDs of error control, EMCY, TIME and LSS."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.device.canopen.objects import U8, array, errors, make_bus, u8, u16, u32
from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.slave import TICK_US, UNCONFIGURED
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID

pytestmark = pytest.mark.unmeasured

CAN_IDS = st.one_of(
    st.sampled_from([0x000, 0x080, 0x082, 0x100, 0x705, 0x707, 0x708, 0x7E4, 0x7E5]),
    st.integers(0, 0x7FF),
)
DLCS = st.integers(0, 8)
LSS = st.builds(
    lambda command, rest: CanFrame(0x7E5, bytes([command, *rest])),
    st.one_of(
        st.sampled_from([0x04, 0x11, 0x13, 0x15, 0x17, 0x46, 0x4C, 0x51]), st.integers(0, 255)
    ),
    st.lists(st.sampled_from([0, 1, 2, 5, 0x80, 0xFF]), min_size=7, max_size=7),
)
NMT = st.builds(
    lambda command: CanFrame(0x000, bytes([command, 0])), st.sampled_from([1, 2, 0x80, 0x81, 0x82])
)
HEARTBEATS = st.builds(lambda can_id: CanFrame(can_id, b"\x05"), st.sampled_from([0x707, 0x708]))
FRAMES = st.one_of(
    st.tuples(CAN_IDS, st.binary(max_size=8)).map(lambda parts: CanFrame(*parts)),
    st.tuples(CAN_IDS, DLCS).map(lambda parts: CanFrame(parts[0], b"", True, False, parts[1])),
    LSS,
    NMT,
    HEARTBEATS,
)
TRAFFIC = st.lists(st.tuples(st.integers(0, 150), FRAMES), max_size=40)
Traffic = list[tuple[int, CanFrame]]


def make() -> Bus:
    return make_bus(
        errors(),
        array(0x1010, 1, 1),
        array(0x1011, 1, 1),
        u32(0x1012, 0xC000_0100),
        array(0x1016, 0x0007_0064, 0x0008_0032),
        u16(0x1017, 0),
        u16(0x100C, 20),
        u8(0x100D, 3),
        array(0x1018, 0, 0, 0, 0),
        array(0x1028, 0x8000_0000, 0x82),
        array(0x1029, 0, kind=U8),
    )


@given(TRAFFIC)
@settings(deadline=None)
def test_noise_never_raises_and_the_slave_goes_on(traffic: Traffic) -> None:
    bus = make()
    slave = bus.slave
    for gap, frame in traffic:
        bus.run(gap % 10)
        bus.step(str(frame))
    bus.now_us = max(bus.now_us, slave.silent_until_us)
    slave.tick(bus.now_us, ())
    if slave.node_id == UNCONFIGURED:
        assert bus.step("7E5#0400000000000000", "7E5#0401000000000000", "7E5#5E00000000000000")
        return
    request = f"{ERROR_CONTROL_COB_ID + slave.node_id:03X}#R1"
    answer = bus.step("000#8000", request)[-1]
    assert answer in (f"{request[:3]}#7F", f"{request[:3]}#FF")


def run_to(bus: Bus, end_us: int, sparse: bool) -> list[tuple[int, CanFrame]]:
    """Run ticks up to a time; leave those out at which nothing is due, if wanted."""
    sent = []
    while bus.now_us < end_us:
        due_us = -(-min(bus.slave.due_us, end_us) // TICK_US) * TICK_US
        bus.now_us = max(bus.now_us + TICK_US, due_us if sparse else 0)
        sent += [(bus.now_us, frame) for frame in bus.slave.tick(bus.now_us, ())]
    return sent


def play(traffic: Traffic, sparse: bool) -> list[tuple[int, CanFrame]]:
    bus, sent = make(), []
    for gap, frame in traffic:
        sent += run_to(bus, bus.now_us + gap * TICK_US, sparse)
        bus.now_us += TICK_US
        sent += [(bus.now_us, out) for out in bus.slave.tick(bus.now_us, (frame,))]
    return sent + run_to(bus, bus.now_us + 300 * TICK_US, sparse)


@given(TRAFFIC)
@settings(deadline=None, max_examples=50)
def test_left_out_idle_ticks_are_not_visible(traffic: Traffic) -> None:
    assert play(traffic, sparse=True) == play(traffic, sparse=False)
