"""A DeviceRTC with any traffic: it goes on, and skipping idle ticks changes nothing."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.device.canopen.slave_bench import Bus
from tests.soak import examples
from tickrig.device.canopen.device_rtc import (
    CanopenComponent,
    CanopenInPort,
    CanopenOutPort,
    DeviceRtc,
    make_device_rtc,
)
from tickrig.device.canopen.slave import TICK_US
from tickrig.device.component import ERROR, Result
from tickrig.wire.can import CanFrame
from tickrig.wire.rtc_canopen import OCTET, SHORT

pytestmark = pytest.mark.unmeasured

Traffic = list[tuple[int, CanFrame | None]]
"""Ticks to wait, then a frame; None presses or releases the button."""


class Moody(CanopenComponent):
    """Each bit of its in-port lets a callback fail."""

    type_name = "Moody"
    rate_hz = 300
    mood = CanopenInPort("mood", OCTET)
    count = CanopenOutPort("count", SHORT)

    def on_initialize(self) -> None:
        self.counted = 0

    def _fails(self, bit: int) -> Result:
        self.counted = (self.counted + 1) % 1_000
        self.count.write(self.counted)
        return ERROR if self.mood.value >> bit & 1 else None

    def on_activated(self) -> Result:
        return self._fails(0)

    def on_deactivated(self) -> Result:
        return self._fails(1)

    def on_execute(self) -> Result:
        return self._fails(2)

    def error_check(self) -> Result:
        return self._fails(3)

    def on_reset(self) -> Result:
        return self._fails(4)


COMMANDS = st.sampled_from([0x01, 0x01, 0x01, 0x02, 0x80, 0x81, 0x82])
FRAMES = st.one_of(
    COMMANDS.map(lambda command: CanFrame(0x000, bytes([command, 16]))),
    st.integers(0, 31).map(lambda mood: CanFrame(0x210, bytes([mood]))),
    st.integers(0, 31).map(lambda mood: CanFrame.parse(f"610#2F002100{mood:02X}000000")),
    st.builds(CanFrame, st.sampled_from([0, 0x080, 0x210, 0x610, 0x7E5]), st.binary(max_size=8)),
    st.none(),
)
TRAFFIC = st.lists(st.tuples(st.sampled_from([1, 1, 2, 3, 10, 150]), FRAMES), max_size=30)


def run_to(bus: Bus, end_us: int, *, sparse: bool) -> list[tuple[int, CanFrame]]:
    sent = []
    while bus.now_us + TICK_US < end_us:
        due_us = -(-bus.slave.due_us // TICK_US) * TICK_US
        bus.now_us = max(bus.now_us + TICK_US, due_us if sparse else 0)
        if bus.now_us >= end_us:
            break
        sent += [(bus.now_us, frame) for frame in bus.slave.tick(bus.now_us, ())]
    bus.now_us = end_us - TICK_US
    return sent


def play(traffic: Traffic, *, sparse: bool) -> list[tuple[int, CanFrame]]:
    bus, sent, now_us = Bus(make_device_rtc(Moody, 16)), [], 0
    for wait, frame in traffic:
        now_us += wait * TICK_US
        sent += run_to(bus, now_us, sparse=sparse)
        if frame is None:
            inputs = DeviceRtc.of(bus.slave).inputs
            inputs.set("shut_down", 1 - int(inputs["shut_down"]))
        rx = () if frame is None else (frame,)
        bus.now_us = now_us
        sent += [(now_us, reply) for reply in bus.slave.tick(now_us, rx)]
    return sent + run_to(bus, now_us + 300 * TICK_US, sparse=sparse)


@settings(max_examples=examples(40))
@given(TRAFFIC)
def test_dense_and_sparse_runs_are_the_same(traffic: Traffic) -> None:
    assert play(traffic, sparse=True) == play(traffic, sparse=False)


@given(TRAFFIC)
def test_after_any_traffic_a_power_cut_makes_it_boot(traffic: Traffic) -> None:
    slave = make_device_rtc(Moody, 16)
    for number, (_, frame) in enumerate(traffic, 1):
        slave.tick(number * TICK_US, () if frame is None else (frame,))
    slave.reset()
    assert [str(frame) for frame in slave.tick(60_000_000, ())] == ["710#00"]
