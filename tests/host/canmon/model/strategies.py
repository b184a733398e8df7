"""Traffic by chance: few identifiers, many kinds of frames, times that may go back."""

from __future__ import annotations

from itertools import accumulate

from hypothesis import strategies as st

from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import CanFrame, ErrorFrame

IDS = st.sampled_from([0x000, 0x083, 0x181, 0x281, 0x583, 0x703, 0x7FF])
DATA = st.one_of(
    st.binary(max_size=8), st.sampled_from([b"\x00", b"\x05", bytes(8), bytes.fromhex("80" * 8)])
)


def data_frame(can_id: int, data: bytes) -> CanFrame:
    return CanFrame(can_id, data)


FRAMES = st.one_of(
    st.builds(data_frame, IDS, DATA),
    st.builds(data_frame, IDS, DATA),
    st.builds(data_frame, st.just(0x703), st.sampled_from([b"\x00", b"\x05", b"\x7f"])),
    st.builds(lambda can_id, data: CanFrame(can_id << 18 | can_id, data, False, True), IDS, DATA),
    st.builds(
        lambda can_id, length: CanFrame(can_id, b"", True, False, length), IDS, st.integers(0, 8)
    ),
    st.builds(ErrorFrame, st.integers(0, 0x3FF), st.binary(min_size=8, max_size=8)),
)
STEPS_US = st.one_of(st.integers(0, 300), st.integers(-5_000, 400_000), st.just(100_000))


@st.composite
def traffic(draw: st.DrawFn) -> list[Record]:
    steps_us = draw(st.lists(STEPS_US, max_size=60))
    begin_us = draw(st.sampled_from([0, 1_700_000_000_000_000]))
    times_us = [max(0, at_us) for at_us in accumulate(steps_us, initial=begin_us)][1:]
    channel = st.sampled_from(["can0", "can0", "can1"])
    return [Record(at_us, draw(channel), draw(FRAMES)) for at_us in times_us]
