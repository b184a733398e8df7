from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canmon.model.transmit import (
    ALGORITHMS,
    FrameFields,
    parse_checksum,
    parse_counter,
)


@pytest.mark.parametrize(
    ("name", "check"),
    [("crc8", 0x4B), ("crc8-2f", 0xDF), ("crc8-07", 0xF4), ("xor", 0x31), ("sum8", 0xDD)],
)
def test_checksums_have_their_published_check_values(name: str, check: int) -> None:
    """Of "123456789": the catalogue of parametrised CRC algorithms; xor and sum by hand."""
    assert ALGORITHMS[name](b"123456789") == check


def test_a_counter_of_some_bits_leaves_the_others_alone() -> None:
    counter = parse_counter("1.4+4:1..14")
    data = [counter.put(b"\xaa\xaa", number).hex() for number in (0, 13, 14)]
    assert data == ["aa1a", "aaea", "aa1a"]


def test_a_checksum_covers_all_other_bytes_or_those_it_names() -> None:
    assert parse_checksum("0:sum8").put(b"\x99\1\2\3").hex() == "06010203"
    assert parse_checksum("3:xor:1..2").put(b"\x99\1\2\3").hex() == "99010203"
    assert parse_checksum("1:xor:0..2").put(b"\x11\x77\x22\3").hex() == "11332203"


@given(st.binary(min_size=1, max_size=8), st.integers(0, 1 << 40))
def test_the_bytes_of_a_frame_with_neg8_sum_up_to_0(data: bytes, number: int) -> None:
    fields = FrameFields((parse_counter("0:0..255"),), (parse_checksum("0:neg8"),))
    assert sum(fields.put(data, number)) & 0xFF == 0
    assert len(fields.put(data, number)) == len(data)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0", "is not BYTE:LOW..HIGH"),
        ("100:0..1", "is not BYTE:LOW..HIGH"),
        ("0.6+4:0..1", "has 4 bits from bit 6 of a byte"),
        ("0:5..5", "counts from 5 to 5"),
        ("0:0..256", "counts from 0 to 256; 8 bits hold 255"),
        ("0.4+4:0..16", "4 bits hold 15"),
    ],
)
def test_what_is_no_counter_is_refused(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        parse_counter(text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("xor", "is not BYTE:ALGORITHM"),
        ("7:md5", "no checksum 'md5'; known: xor, sum8, neg8, crc8, crc8-2f, crc8-07"),
        ("7:xor:3..1", "covers bytes 3 to 1"),
    ],
)
def test_what_is_no_checksum_is_refused(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        parse_checksum(text)


def test_a_field_must_be_in_the_frame() -> None:
    FrameFields().check(0)
    FrameFields((parse_counter("1:0..9"),)).check(2)
    with pytest.raises(ValueError, match="no byte 1 for a counter or checksum: 1 bytes are sent"):
        FrameFields((parse_counter("1:0..9"),)).check(1)
    with pytest.raises(ValueError, match="no byte 6"):
        FrameFields((), (parse_checksum("0:xor:1..6"),)).check(6)
