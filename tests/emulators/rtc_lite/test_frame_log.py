from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tests.wire.rtc_lite.vectors import REPLIES, REQUESTS, raw
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.emulators.rtc_lite.line import frame_splitter
from tickrig.host.text.trace import Mark
from tickrig.wire.rtc_lite.frame import Framing


def test_frames_of_both_directions_are_shown_without_header_and_checksum() -> None:
    make = frame_splitter(LiteConfig())
    assert make(Mark.TO_DEVICE)(0, b"".join(REQUESTS)) == [data[1:-1] for data in REQUESTS]
    assert make(Mark.FROM_DEVICE)(0, b"".join(REPLIES)) == [data[1:-1] for data in REPLIES]


def test_what_is_no_frame_is_named() -> None:
    split = frame_splitter(LiteConfig())(Mark.TO_DEVICE)
    assert split(0, raw("0A 41 41 83", "0A 5A 7A D4")) == [b"(wrong checksum)", b"(unknown frame)"]
    assert split(19_000, REQUESTS[0]) == []
    assert split(40_000, REQUESTS[0][:2]) == []
    assert split(140_000, REQUESTS[0]) == [b"(broken off)", b"CX"]


def test_packets_of_rtno_are_listened_to_with_the_same_pauses() -> None:
    split = frame_splitter(LiteConfig(Framing.RTNO))(Mark.TO_DEVICE)
    state = raw("0A 0A 58 00 58")
    assert split(0, raw("0A 0A 58 00 59") + state) == [b"(wrong checksum)", b"X"]
    assert split(1_000, raw("0A 0A 58 FF 00")) == [b"(unknown frame)"]
    assert split(2_000, state) == []
    assert split(30_000, state[:3]) == []
    assert split(130_000, state) == [b"(broken off)", b"X"]


@given(st.lists(st.binary(max_size=200), max_size=9))
def test_any_bytes_can_be_listened_to(chunks: list[bytes]) -> None:
    split = frame_splitter(LiteConfig())(Mark.TO_DEVICE)
    for number, chunk in enumerate(chunks):
        split(number * 1_000, chunk)
    assert split(10_000_000, REQUESTS[0])[-1] == b"CX"
