from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.errors import WireError
from tickrig.wire.modbus import (
    MAX_READ,
    MAX_WRITE,
    MAX_WRITE_WHILE_READ,
    ExceptionCode,
    Refusal,
    Request,
    encode_exception,
    encode_frame,
    encode_request,
    encode_response,
    parse_frame,
    parse_request,
    silence_us,
)

words = st.integers(0, 0xFFFF)
reads = st.tuples(words, st.integers(1, MAX_READ)).filter(lambda r: sum(r) <= 0x1_0000)


def writes(most: int) -> st.SearchStrategy[tuple[int, tuple[int, ...]]]:
    values = st.lists(words, min_size=1, max_size=most).map(tuple)
    return st.tuples(words, values).filter(lambda w: w[0] + len(w[1]) <= 0x1_0000)


requests = st.one_of(
    st.builds(Request, st.just(3), reads),
    st.builds(Request, st.just(6), st.none(), st.tuples(words, st.tuples(words))),
    st.builds(Request, st.just(16), st.none(), writes(MAX_WRITE)),
    st.builds(Request, st.just(23), reads, writes(MAX_WRITE_WHILE_READ)),
)


@given(requests)
def test_a_request_is_read_as_it_was_written(request: Request) -> None:
    assert parse_request(encode_request(request)) == request


@given(st.integers(0, 247), st.binary(min_size=1, max_size=253))
def test_a_frame_is_read_as_it_was_written(address: int, message: bytes) -> None:
    assert parse_frame(encode_frame(address, message)) == (address, message)


@given(st.binary(max_size=300))
def test_any_bytes_are_a_frame_or_a_wire_error(data: bytes) -> None:
    try:
        address, message = parse_frame(data)
    except WireError:
        return
    assert encode_frame(address, message) == data


@given(st.binary(min_size=1, max_size=253))
def test_any_message_is_a_request_or_refused(message: bytes) -> None:
    try:
        request = parse_request(message)
    except Refusal:
        return
    assert encode_request(request) == message


@pytest.mark.parametrize(
    ("message", "code"),
    [
        ("05 0000 ff00", ExceptionCode.ILLEGAL_FUNCTION),
        ("03 0000", ExceptionCode.ILLEGAL_DATA_VALUE),
        ("03 0000 0000", ExceptionCode.ILLEGAL_DATA_VALUE),
        ("03 0000 007e", ExceptionCode.ILLEGAL_DATA_VALUE),
        ("03 ffff 0002", ExceptionCode.ILLEGAL_DATA_ADDRESS),
        ("10 0000 0001", ExceptionCode.ILLEGAL_DATA_VALUE),
        ("10 0000 0001 04 0000", ExceptionCode.ILLEGAL_DATA_VALUE),
        ("10 0000 0000 00", ExceptionCode.ILLEGAL_DATA_VALUE),
        ("10 ffff 0002 04 0000 0000", ExceptionCode.ILLEGAL_DATA_ADDRESS),
    ],
)
def test_a_request_that_cannot_be_has_its_exception(message: str, code: ExceptionCode) -> None:
    with pytest.raises(Refusal) as refused:
        parse_request(bytes.fromhex(message))
    assert refused.value.code is code


def test_the_examples_of_the_application_protocol() -> None:
    """Modbus Application Protocol 1.1b3: examples of functions 03, 06, 10h and 17h."""
    read = Request(3, (0x6B, 3))
    assert encode_request(read).hex() == "03006b0003"
    assert encode_response(read, (0x022B, 0, 0x64)).hex() == "0306022b00000064"
    one = Request(6, write=(1, (3,)))
    assert encode_request(one).hex() == encode_response(one).hex() == "0600010003"
    many = Request(16, write=(1, (0x0A, 0x0102)))
    assert encode_request(many).hex() == "100001000204000a0102"
    assert encode_response(many).hex() == "1000010002"
    both = Request(23, (3, 6), (14, (255, 255, 255)))
    assert encode_request(both).hex() == "1700030006000e00030600ff00ff00ff"
    answer = encode_response(both, (0xFE, 0x0ACD, 1, 3, 0x0D, 0xFF))
    assert answer.hex() == "170c00fe0acd00010003000d00ff"
    assert encode_exception(0x01, ExceptionCode.ILLEGAL_DATA_ADDRESS).hex() == "8102"


def test_frames_are_parted_by_three_and_a_half_characters_up_to_19200_baud() -> None:
    assert [silence_us(baud) for baud in (9_600, 19_200, 19_201)] == [3_646, 1_823, 1_750]
