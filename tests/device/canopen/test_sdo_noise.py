from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.device.canopen.sdo_client import OPEN_SECOND, Client, booted, pattern
from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.slave import TICK_US
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.sdo import (
    Abort,
    DownloadInitiateRequest,
    DownloadInitiateResponse,
    UploadInitiateRequest,
    UploadInitiateResponse,
    parse_response,
)
from tickrig.wire.canopen.sdo_frame import BlockEnded

pytestmark = pytest.mark.unmeasured

READ_TYPE, TYPE = "605#4000100000000000", ["585#4300100091010F00"]
ABORT = "605#8000000000000008"

INDICES = [0x1000, 0x1001, 0x1008, 0x1009, 0x1018, 0x2000, 0x2001, 0x2003, 0x2004, 0x2007, 0x2008]
MULTIPLEXERS = st.builds(
    lambda index, sub: index.to_bytes(2, "little") + bytes([sub]),
    st.sampled_from([*INDICES, 0x3FFF]),
    st.integers(0, 2),
)
COMMANDS = st.sampled_from([0x00, 0x10, 0x01, 0x20, 0x21, 0x23, 0x2F, 0x40, 0x60, 0x70, 0xE0]) | (
    st.sampled_from([0x81, 0xA0, 0xA1, 0xA2, 0xA3, 0xA4, 0xC0, 0xC1, 0xC2, 0xC6, 0xD5])
)
LIKELY = st.builds(
    lambda command, multiplexer, rest: bytes([command]) + multiplexer + rest,
    COMMANDS,
    MULTIPLEXERS,
    st.sampled_from([b"\0\0\0\0", b"\1\0\0\0", b"\x10\0\0\0", b"\x7f\0\0\0", b"\x14\x20\0\0"]),
)
NOISE = st.binary(max_size=8) | LIKELY


@given(st.lists(st.tuples(NOISE, st.sampled_from([1, 1, 1, 250, 5_000])), max_size=40))
def test_noise_never_raises_nor_stops_the_server(noise: list[tuple[bytes, int]]) -> None:
    bus = booted()
    for data, pause_ms in noise:
        bus.now_us += (pause_ms - 1) * TICK_US
        bus.step(str(CanFrame(0x605, data)))
    bus.step(ABORT)
    assert bus.step(READ_TYPE) == TYPE


@given(st.lists(NOISE, max_size=40))
def test_a_client_that_gives_up_silently_is_served_again(noise: list[bytes]) -> None:
    bus = booted()
    for data in noise:
        bus.step(str(CanFrame(0x605, data)))
    bus.run(5_001)
    assert bus.step(READ_TYPE) == TYPE


def names(answer: bytes) -> tuple[int, int] | None:
    """Return the object that an answer names, None if it names none."""
    match parse_response(answer):
        case UploadInitiateResponse(index, sub) | Abort(index, sub, _):
            return index, sub
        case DownloadInitiateResponse(index, sub):
            return index, sub
        case _:
            return None


@given(
    st.lists(
        st.tuples(
            st.sampled_from([0x605, 0x6A0]),
            st.builds(UploadInitiateRequest, st.sampled_from(INDICES), st.just(0))
            | st.builds(
                lambda index: DownloadInitiateRequest(index, 0, b"\x11", 1),
                st.sampled_from(INDICES),
            ),
        ),
        max_size=40,
    )
)
def test_an_initiate_is_answered_with_the_object_it_names(
    requests: list[tuple[int, UploadInitiateRequest | DownloadInitiateRequest]],
) -> None:
    bus = booted()
    bus.step(*OPEN_SECOND)
    for can_id, request in requests:
        (answer,) = bus.step(str(CanFrame(can_id, request.encode())))
        assert answer[:3] == {0x605: "585", 0x6A0: "6A1"}[can_id]
        assert names(bytes.fromhex(answer[4:])) == (request.index, 0)


OTHERS = LIKELY.filter(lambda data: data[1:3] != b"\x08\x20")
"""What another client sends; it never writes to 2008h."""


class Interleaved(Bus):
    """Plays another client's frame between any two of the first one."""

    def __init__(self, bus: Bus, others: list[str]) -> None:
        super().__init__(bus.slave)
        self.now_us, self._others = bus.now_us, others

    def step(self, *texts: str) -> list[str]:
        if self._others:
            super().step(self._others.pop(0))
        return super().step(*texts)


@given(
    st.lists(st.tuples(st.booleans(), st.booleans(), st.integers(0, 200)), max_size=6),
    st.lists(OTHERS.map(lambda data: str(CanFrame(0x6A0, data))), max_size=200),
)
def test_one_client_never_gets_what_another_asked_for(
    transfers: list[tuple[bool, bool, int]], others: list[str]
) -> None:
    bus = booted()
    bus.step(*OPEN_SECOND)
    client = Client(Interleaved(bus, others))
    for written_in_blocks, read_in_blocks, size in transfers:
        data = pattern(size)
        if written_in_blocks:
            assert client.block_download(0x2008, data) == BlockEnded()
        else:
            client.download(0x2008, data)
        if read_in_blocks:
            assert client.block_upload(0x2008, [3, 7]) == data
        else:
            assert client.upload(0x2008) == data
