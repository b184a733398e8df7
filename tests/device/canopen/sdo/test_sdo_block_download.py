from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.device.canopen.sdo_client import Client, booted, offer_blocks_of, pattern
from tickrig.wire.canopen.sdo import Abort
from tickrig.wire.canopen.sdo_frame import (
    AbortCode,
    BlockAcknowledge,
    BlockDownloadInitiateRequest,
    BlockDownloadInitiateResponse,
    BlockEnd,
    BlockEnded,
    BlockSegment,
    crc16,
)

TEXT = b"A really really long string..."
SEGMENTS = [
    "605#0141207265616C6C",
    "605#0279207265616C6C",
    "605#0379206C6F6E6720",
    "605#04737472696E672E",
    "605#852E2E0000000000",
]
BEGIN, BEGUN = "605#C60720001E000000", ["585#A40720007F000000"]
END, ENDED = "605#D545690000000000", ["585#A100000000000000"]


def test_30_bytes_go_in_5_segments() -> None:
    bus = booted()
    assert bus.step(BEGIN) == BEGUN  # BD-03
    assert [bus.step(segment) for segment in SEGMENTS[:4]] == [[]] * 4
    assert bus.step(SEGMENTS[4]) == ["585#A2057F0000000000"]
    assert bus.slave.dictionary[0x2007, 0].value == "short"
    assert bus.step(END) == ENDED
    assert bus.slave.dictionary[0x2007, 0].data == TEXT


def test_without_crc_the_field_is_not_looked_at() -> None:
    bus = booted()
    assert bus.step("605#C217100002000000") == ["585#A01710007F000000"]  # BD-02
    assert bus.step("605#8164000000000000") == ["585#A2017F0000000000"]
    assert bus.step("605#D5FFFF0000000000") == ENDED
    assert bus.slave.dictionary[0x1017, 0].value == 100


def test_the_size_may_be_left_out() -> None:
    bus = booted()
    client = Client(bus)
    client.ask(BlockDownloadInitiateRequest(0x2007, 0, crc=True, size=None))
    client.ask(BlockSegment(1, b"abc", last=True))
    assert client.ask(BlockEnd(4, crc16(b"abc"))) == BlockEnded()
    assert bus.slave.dictionary[0x2007, 0].value == "abc"


@pytest.mark.parametrize("missing", range(4))
def test_a_lost_segment_is_acknowledged_and_repeated(missing: int) -> None:
    bus = booted()
    bus.step(BEGIN)
    sent = SEGMENTS[:missing] + SEGMENTS[missing + 1 :]
    assert bus.step(*sent) == [f"585#A2{missing:02X}7F0000000000"]  # BD-05
    repeated = [f"605#{int(text[4:6], 16) - missing:02X}{text[6:]}" for text in SEGMENTS[missing:]]
    assert bus.step(*repeated) == [f"585#A2{5 - missing:02X}7F0000000000"]
    assert bus.step(END) == ENDED
    assert bus.slave.dictionary[0x2007, 0].data == TEXT


def test_a_segment_that_comes_twice_counts_once() -> None:
    bus = booted()
    bus.step(BEGIN)
    twice = [text for segment in SEGMENTS[:4] for text in (segment, segment)]
    assert bus.step(*twice, SEGMENTS[4]) == ["585#A2057F0000000000"]
    assert bus.step(END) == ENDED


def test_segments_that_come_again_later_count_once() -> None:
    bus = booted()
    bus.step(BEGIN)
    bus.step(*SEGMENTS[:2])
    assert bus.step(*SEGMENTS) == ["585#A2057F0000000000"]
    assert bus.step(END) == ENDED
    assert bus.slave.dictionary[0x2007, 0].data == TEXT


def test_a_segment_that_is_dropped_restarts_the_time_out() -> None:
    bus = booted()
    bus.step(BEGIN)
    assert bus.run(3_000) == []
    bus.step(SEGMENTS[1])
    assert bus.run(4_999) == []
    assert bus.step() == ["585#8007200000000405"]


def test_after_its_end_no_transfer_runs() -> None:
    bus = booted()
    bus.step(BEGIN, *SEGMENTS)
    assert bus.step(END) == ENDED
    assert bus.step(END) == ["585#8000000001000405"]
    assert bus.run(6_000) == []


def test_reserved_bytes_behind_the_crc_are_ignored() -> None:
    bus = booted()
    bus.step(BEGIN, *SEGMENTS)
    assert bus.step("605#D54569FFFFFFFFFF") == ENDED


def test_too_many_bytes_are_refused_at_the_end_of_the_block() -> None:
    bus = booted()
    client = Client(bus)
    client.ask(BlockDownloadInitiateRequest(0x2007, 0, crc=True, size=None))
    block = [BlockSegment(number, b"7 bytes", last=False) for number in range(1, 128)]
    assert client.ask(*block) == Abort(0x2007, 0, AbortCode.TOO_LONG)


def test_a_client_may_be_slow_inside_a_block() -> None:
    bus = booted()
    bus.step(BEGIN)
    for segment in SEGMENTS[:4]:
        assert bus.step(segment) + bus.run(4_998) == []
    assert bus.step(SEGMENTS[4]) == ["585#A2057F0000000000"]
    assert bus.run(4_998) == []
    assert bus.step(END) == ENDED


@pytest.mark.unmeasured
@pytest.mark.parametrize("received", range(1, 6))
def test_a_client_silent_in_a_block_is_aborted_after_5_s(received: int) -> None:
    bus = booted()
    bus.step(BEGIN)
    bus.step(*SEGMENTS[:received])
    assert bus.run(4_999) == []
    assert bus.step() == ["585#8007200000000405"]
    assert bus.run(10_000) == []


def test_a_client_may_abort_inside_a_block() -> None:
    bus = booted()
    bus.step(BEGIN)
    bus.step(SEGMENTS[0])
    assert bus.step("605#8007200000000008") + bus.run(30) == []  # BD-09
    assert bus.step("605#4001100000000000") == ["585#4F01100000000000"]
    assert bus.slave.dictionary[0x2007, 0].value == "short"


@pytest.mark.parametrize(
    ("begin", "answer"),
    [
        ("C200100004000000", "8000100002000106"),  # BD-07
        ("C2FF3F0004000000", "80FF3F0000000206"),  # BD-08
        ("C601200003000000", "8001200012000706"),
        ("C601200001000000", "8001200013000706"),
        ("C607200041000000", "8007200012000706"),
    ],
)
def test_a_block_download_is_refused_at_its_begin(begin: str, answer: str) -> None:
    assert booted().step(f"605#{begin}") == [f"585#{answer}"]


@pytest.mark.parametrize(
    ("size", "end", "code"),
    [
        (30, BlockEnd(5, 0x6944), AbortCode.CRC),  # BD-04
        (29, BlockEnd(5, 0x6945), AbortCode.TOO_LONG),
        (31, BlockEnd(5, 0x6945), AbortCode.TOO_SHORT),  # BD-11
        (30, BlockEnd(4, 0x6945), AbortCode.TOO_LONG),
        (16, BlockEnd(5, 0x6945), AbortCode.TOO_LONG),
    ],
)
def test_what_does_not_match_its_announcement_changes_nothing(
    size: int, end: BlockEnd, code: AbortCode
) -> None:
    bus = booted()
    client = Client(bus)
    client.ask(BlockDownloadInitiateRequest(0x2007, 0, crc=True, size=size))
    answer = bus.step(*SEGMENTS)
    if answer[0].startswith("585#A2"):
        assert client.ask(end) == Abort(0x2007, 0, code)
    else:
        assert answer == ["585#8007200012000706"]
    assert bus.slave.dictionary[0x2007, 0].value == "short"


def test_the_object_may_refuse_at_the_end() -> None:
    bus = booted()
    client = Client(bus)
    client.ask(BlockDownloadInitiateRequest(0x2006, 0, crc=False, size=None))
    client.ask(BlockSegment(1, b"\x21", last=True))
    assert client.ask(BlockEnd(6, 0)) == Abort(0x2006, 0, AbortCode.VALUE_TOO_HIGH)
    assert bus.slave.dictionary[0x2006, 0].value == 0x10


def test_what_is_no_end_after_the_last_segment_aborts() -> None:
    bus = booted()
    bus.step(BEGIN, *SEGMENTS)
    assert bus.step("605#A100000000000000") == ["585#8007200001000405"]
    assert bus.step(END) == ["585#8000000001000405"]


def test_a_new_request_after_the_last_segment_begins_anew() -> None:
    bus = booted()
    bus.step(BEGIN, *SEGMENTS)
    assert bus.step("605#4007200000000000") == ["585#4107200005000000"]


@pytest.mark.unmeasured
@pytest.mark.parametrize("block_size", range(1, 128))
def test_every_block_size_serves(block_size: int) -> None:
    bus = booted()
    offer_blocks_of(bus, block_size)
    for size in (1, 7 * block_size - 1, 7 * block_size, 7 * block_size + 1, 2_000):
        assert Client(bus).block_download(0x2008, pattern(size)) == BlockEnded()
        assert bus.slave.dictionary[0x2008, 0].data == pattern(size)


def test_the_block_size_may_change_in_a_transfer() -> None:
    bus = booted()
    client = Client(bus)
    offer_blocks_of(bus, 2)
    begun = client.ask(BlockDownloadInitiateRequest(0x2007, 0, crc=True, size=30))
    assert begun == BlockDownloadInitiateResponse(0x2007, 0, crc=True, block_size=2)
    offer_blocks_of(bus, 127)
    assert client.send(BlockSegment(1, TEXT[:7])) == []
    assert client.ask(BlockSegment(2, TEXT[7:14])) == BlockAcknowledge(2, 127)
    rest = [BlockSegment(1, TEXT[14:21]), BlockSegment(2, TEXT[21:28])]
    assert client.ask(*rest, BlockSegment(3, TEXT[28:], last=True)) == BlockAcknowledge(3, 127)
    assert client.ask(BlockEnd(5, 0x6945)) == BlockEnded()


def test_no_bytes_are_an_empty_segment() -> None:
    bus = booted()
    bus.slave.dictionary[0x2008, 0].value = b"something"
    assert Client(bus).block_download(0x2008, b"") == BlockEnded()
    assert bus.slave.dictionary[0x2008, 0].data == b""


@pytest.mark.unmeasured
@given(
    size=st.integers(1, 3_000),
    block_size=st.integers(1, 127),
    lost=st.frozensets(st.integers(0, 500), max_size=60),
)
def test_whatever_is_lost_the_data_arrives(
    size: int, block_size: int, lost: frozenset[int]
) -> None:
    bus = booted()
    offer_blocks_of(bus, block_size)
    client = Client(bus)
    assert client.block_download(0x2008, pattern(size), lost) == BlockEnded()
    assert bus.slave.dictionary[0x2008, 0].data == pattern(size)
