from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.canopen.sdo import (
    Abort,
    DownloadInitiateRequest,
    DownloadInitiateResponse,
    DownloadSegmentResponse,
    Request,
    Response,
    Segment,
    UploadInitiateRequest,
    UploadInitiateResponse,
    UploadSegmentRequest,
    parse_request,
    parse_response,
)
from tickrig.wire.canopen.sdo_frame import (
    AbortCode,
    BlockAcknowledge,
    BlockDownloadInitiateRequest,
    BlockDownloadInitiateResponse,
    BlockEnd,
    BlockEnded,
    BlockSegment,
    BlockStart,
    BlockUploadInitiateRequest,
    BlockUploadInitiateResponse,
    crc16,
)
from tickrig.wire.errors import FieldError, FramingError, WireError

# Frames of the conformance checks named (tests/golden/canopen), UE-01 to BU-12.
REQUESTS: dict[str, Request] = {
    "4000100000000000": UploadInitiateRequest(0x1000, 0),
    "2F002000A5000000": DownloadInitiateRequest(0x2000, 0, b"\xa5", 1),
    "23022000EFBEADDE": DownloadInitiateRequest(0x2002, 0, b"\xef\xbe\xad\xde", 4),
    "2200200007000000": DownloadInitiateRequest(0x2000, 0, b"\x07\0\0\0"),
    "2107200010000000": DownloadInitiateRequest(0x2007, 0, size=16),
    "2007200000000000": DownloadInitiateRequest(0x2007, 0),
    "0B64000000000000": Segment(toggle=False, data=b"\x64\x00", last=True),
    "107369787465656E": Segment(toggle=True, data=b"sixteen", last=False),
    "6000000000000000": UploadSegmentRequest(toggle=False),
    "7000000000000000": UploadSegmentRequest(toggle=True),
    "8008100000000008": Abort(0x1008, 0, AbortCode.GENERAL),
    "8008100001000000": Abort(0x1008, 0, 1),
    "C60720001E000000": BlockDownloadInitiateRequest(0x2007, 0, crc=True, size=30),
    "C017100000000000": BlockDownloadInitiateRequest(0x1017, 0, crc=False, size=None),
    "D545690000000000": BlockEnd(fill=5, crc=0x6945),
    "A40810007F0F0000": BlockUploadInitiateRequest(0x1008, 0, True, 127, threshold=15),
    "A000100014000000": BlockUploadInitiateRequest(0x1000, 0, crc=False, block_size=20),
    "A300000000000000": BlockStart(),
    "A2037F0000000000": BlockAcknowledge(3, 127),
    "A100000000000000": BlockEnded(),
}
RESPONSES: dict[str, Response] = {
    "4300100091010F00": UploadInitiateResponse(0x1000, 0, b"\x91\x01\x0f\0", 4),
    "4B09100052310000": UploadInitiateResponse(0x1009, 0, b"R1", 2),
    "410810000F000000": UploadInitiateResponse(0x1008, 0, size=15),
    "6001200000000000": DownloadInitiateResponse(0x2001, 0),
    "007265666572656E": Segment(toggle=False, data=b"referen", last=False),
    "0D65000000000000": Segment(toggle=False, data=b"e", last=True),
    "2000000000000000": DownloadSegmentResponse(toggle=False),
    "3000000000000000": DownloadSegmentResponse(toggle=True),
    "8000100111000906": Abort(0x1000, 1, AbortCode.NO_SUBINDEX),
    "A40720007F000000": BlockDownloadInitiateResponse(0x2007, 0, crc=True, block_size=127),
    "A2057F0000000000": BlockAcknowledge(5, 127),
    "A100000000000000": BlockEnded(),
    "C60810000F000000": BlockUploadInitiateResponse(0x1008, 0, crc=True, size=15),
    "D917B50000000000": BlockEnd(fill=6, crc=0xB517),
}


@pytest.mark.parametrize(("text", "request_"), REQUESTS.items())
def test_a_request_is_read_and_written(text: str, request_: Request) -> None:
    assert parse_request(bytes.fromhex(text)) == request_
    assert request_.encode().hex().upper() == text


@pytest.mark.parametrize(("text", "response"), RESPONSES.items())
def test_a_response_is_read_and_written(text: str, response: Response) -> None:
    assert parse_response(bytes.fromhex(text)) == response
    assert response.encode().hex().upper() == text


@pytest.mark.parametrize(
    ("text", "segment"),
    [
        ("0141207265616C6C", BlockSegment(1, b"A reall")),
        ("852E2E0000000000", BlockSegment(5, b"..\0\0\0\0\0", last=True)),
    ],
)
def test_a_segment_of_a_block_is_read_and_written(text: str, segment: BlockSegment) -> None:
    assert BlockSegment.parse(bytes.fromhex(text)) == segment
    assert segment.encode().hex().upper() == text


@pytest.mark.parametrize("parse", [parse_request, parse_response])
@pytest.mark.parametrize("text", ["", "40001000", "400010000000000000", "E000100000000000"])
def test_what_is_no_command_is_refused(parse: Callable[[bytes], object], text: str) -> None:
    with pytest.raises(FramingError):
        parse(bytes.fromhex(text))


def test_a_server_has_no_start_command() -> None:
    with pytest.raises(FramingError, match="A3h"):
        parse_response(BlockStart().encode())


@pytest.mark.parametrize(
    "make",
    [
        lambda: DownloadInitiateRequest(0x2000, 0, b""),
        lambda: DownloadInitiateRequest(0x2000, 0, b"12345", 5),
        lambda: DownloadInitiateRequest(0x2000, 0, b"12"),
        lambda: DownloadInitiateRequest(0x2000, 0, b"12", 3),
        lambda: DownloadInitiateRequest(0x2000, 0, size=1 << 32).encode(),
        lambda: UploadInitiateRequest(0x1_0000, 0).encode(),
        lambda: UploadInitiateRequest(0x2000, 256).encode(),
        lambda: Segment(toggle=False, data=b"12345678", last=False),
        lambda: BlockSegment(128, b""),
        lambda: BlockSegment(1, b"12345678"),
    ],
)
def test_what_does_not_fit_into_a_frame_is_refused(make: Callable[[], object]) -> None:
    with pytest.raises(FieldError):
        make()


def test_the_crc_of_the_published_vectors() -> None:
    assert crc16(b"123456789") == 0x31C3
    assert crc16(b"A really really long string...") == 0x6945
    assert crc16(b"") == 0


@given(st.binary(max_size=9))
def test_any_bytes_are_read_or_refused(frame: bytes) -> None:
    for parse in (parse_request, parse_response):
        try:
            value = parse(frame)
        except WireError:
            continue
        assert parse(value.encode()) == value


@given(st.binary(min_size=8, max_size=8))
def test_any_segment_of_a_block_is_read(frame: bytes) -> None:
    assert BlockSegment.parse(frame).encode() == frame
