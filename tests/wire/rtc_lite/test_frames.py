from __future__ import annotations

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.wire.rtc_lite.vectors import REPLIES, REQUESTS, raw
from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_lite import frame as layout
from tickrig.wire.rtc_lite.codes import LiteCommand, LiteLinkFault, LiteStatus
from tickrig.wire.rtc_lite.frame import (
    MAX_DATA_BYTES,
    Checksum,
    Layout,
    LiteDecoder,
    LiteFrame,
    fault_frame,
)

DIRECTIONS = {"request": layout.REQUESTS, "reply": layout.REPLIES}


def hexed(data: bytes) -> str:
    return data.hex(" ").upper()


@st.composite
def frames(draw: st.DrawFn, layouts: dict[LiteCommand, Layout]) -> LiteFrame:
    """Any frame of a direction: its data is drawn until the layout says it is whole."""
    command = draw(st.sampled_from(list(layouts)))
    data, size = b"", layouts[command](b"")
    while len(data) < size <= MAX_DATA_BYTES:
        low_counts = st.integers(0, 20) | st.sampled_from(list(LiteStatus))
        data += bytes([draw(low_counts if len(data) < 4 else st.integers(0, 255))])
        size = layouts[command](data)
    assume(size <= MAX_DATA_BYTES)
    return LiteFrame(command, data)


requests = frames(dict(layout.REQUESTS))
replies = frames(dict(layout.REPLIES))


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("data", "direction"),
    [*((data, "request") for data in REQUESTS), *((data, "reply") for data in REPLIES)],
    ids=[hexed(data) for data in REQUESTS + REPLIES],
)
def test_a_golden_frame_is_read_and_written_back(data: bytes, direction: str) -> None:
    (frame,) = LiteDecoder(DIRECTIONS[direction]).push(data)
    assert isinstance(frame, LiteFrame)
    assert frame.encode() == data


@pytest.mark.unmeasured
@given(st.lists(requests, max_size=5), st.sampled_from(Checksum), st.integers(1, 9))
def test_requests_come_back_however_they_are_cut(
    sent: list[LiteFrame], checksum: Checksum, size: int
) -> None:
    decoder = LiteDecoder(layout.REQUESTS, checksum)
    data = b"".join(frame.encode(checksum) for frame in sent)
    chunks = [data[at : at + size] for at in range(0, len(data), size)]
    assert [item for chunk in chunks for item in decoder.push(chunk)] == sent
    assert not decoder.begun


@pytest.mark.unmeasured
@given(st.lists(replies, max_size=5), st.sampled_from(Checksum))
def test_replies_come_back(sent: list[LiteFrame], checksum: Checksum) -> None:
    data = b"".join(frame.encode(checksum) for frame in sent)
    assert LiteDecoder(layout.REPLIES, checksum).push(data) == sent


@given(st.binary(max_size=200), st.sampled_from(["request", "reply"]))
def test_after_any_noise_a_cleared_decoder_reads_the_next_frame(
    noise: bytes, direction: str
) -> None:
    decoder = LiteDecoder(DIRECTIONS[direction])
    decoder.push(noise)
    decoder.clear()
    sample = REQUESTS[0] if direction == "request" else REPLIES[0]
    (frame,) = decoder.push(sample)
    assert isinstance(frame, LiteFrame)


def test_bytes_before_a_header_are_passed_over() -> None:
    assert LiteDecoder(layout.REQUESTS).push(b"\x43\x58\x9b" + REQUESTS[0]) == [
        LiteFrame(LiteCommand.STATE)
    ]


def test_a_header_within_data_is_data() -> None:
    ping = LiteFrame(LiteCommand.PING, b"\n")
    assert LiteDecoder(layout.REQUESTS).push(ping.encode() * 2) == [ping, ping]


def test_a_wrong_checksum_is_told_and_the_next_frame_is_read() -> None:
    found = LiteDecoder(layout.REQUESTS).push(raw("0A 41 41 83", "0A 43 58 9B"))
    assert found == [LiteLinkFault.CHECKSUM, LiteFrame(LiteCommand.STATE)]


@pytest.mark.parametrize("command", ["5A 7A", "51 56", "46 48"], ids=["none", "reply", "fault"])
def test_after_a_command_of_no_request_all_is_thrown_away(command: str) -> None:
    decoder = LiteDecoder(layout.REQUESTS)
    assert decoder.push(raw(f"0A {command}")) == []
    assert decoder.push(b"\x00" + REQUESTS[0]) == [LiteLinkFault.UNKNOWN]
    assert decoder.lost
    decoder.clear()
    assert decoder.push(REQUESTS[0]) == [LiteFrame(LiteCommand.STATE)]


def test_more_data_than_fit_are_noticed_at_their_count() -> None:
    decoder = LiteDecoder(layout.REQUESTS)
    assert decoder.push(raw("0A 50 53 02 38")) == []
    decoder.clear()
    assert decoder.push(raw("0A 50 53 02 39 69 6E")) == [LiteLinkFault.UNKNOWN]
    assert decoder.lost
    assert not decoder.begun


def test_a_frame_of_more_than_60_data_bytes_is_refused() -> None:
    assert len(LiteFrame(LiteCommand.WRITE, bytes(60)).encode()) == 64
    with pytest.raises(FieldError, match="61 data bytes, at most 60 fit"):
        LiteFrame(LiteCommand.WRITE, bytes(61))


def test_parity_is_another_checksum() -> None:
    assert LiteFrame(LiteCommand.STATE).encode(Checksum.XOR8) == raw("0A 43 58 1B")
    assert LiteDecoder(layout.REQUESTS, Checksum.XOR8).push(REQUESTS[0]) == [LiteLinkFault.CHECKSUM]


@pytest.mark.parametrize(
    ("fault", "frame"),
    [
        (LiteLinkFault.TIMEOUT, "0A 46 4B 01 92"),
        (LiteLinkFault.CHECKSUM, "0A 46 48 03 91"),
        (LiteLinkFault.UNKNOWN, "0A 46 55 41 DC"),
    ],
)
def test_each_fault_has_its_frame(fault: LiteLinkFault, frame: str) -> None:
    assert fault_frame(fault).encode() == raw(frame)


@pytest.mark.parametrize(
    ("reply", "size"),
    [
        (b"@\x02\x01\x02", 4),
        (b"D", 1),
        (b"@\x00", 2),
        (b"I", 1),
        (b"H", 1),
    ],
)
def test_a_polled_out_port_brings_data_only_when_it_has_some(reply: bytes, size: int) -> None:
    assert layout.REPLIES[LiteCommand.POLL](reply) == size


def test_a_refused_profile_ends_with_its_status() -> None:
    assert layout.REPLIES[LiteCommand.PROFILE](b"!") == 1
