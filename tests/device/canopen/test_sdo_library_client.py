"""The SDO client of the canopen library against our server, without a thread or a clock."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from canopen.objectdictionary import ObjectDictionary
from canopen.sdo.client import BlockUploadStream, SdoClient
from canopen.sdo.exceptions import SdoAbortedError

from tests.device.canopen.sdo_client import booted, offer_blocks_of, pattern
from tests.device.canopen.slave_bench import Bus
from tickrig.wire.can import CanFrame

pytestmark = pytest.mark.unmeasured

SIZES = [1, 2, 4, 5, 7, 8, 127, 889, 890, 5_000]


class Wire:
    """What the library's client takes for a network: each frame is a tick of the slave.

    Attributes:
        lost: says which frames the wire loses, by running number, out and back alike.
    """

    def __init__(self, bus: Bus) -> None:
        self._bus, self._count = bus, 0
        make_client: Any = SdoClient  # the library's calls have no types
        make_dictionary: Any = ObjectDictionary
        self.client = make_client(0x605, 0x585, make_dictionary())
        self.client.network = self
        self.client.RESPONSE_TIMEOUT = 0.0
        self.lost: Callable[[int], bool] = lambda number: False

    def send_message(self, can_id: int, data: bytes) -> None:
        if self._passes():
            for text in self._bus.step(str(CanFrame(can_id, bytes(data)))):
                if self._passes():
                    frame = CanFrame.parse(text)
                    self.client.on_response(frame.can_id, frame.data, 0.0)

    def _passes(self) -> bool:
        self._count += 1
        return not self.lost(self._count)


@pytest.mark.parametrize("size", SIZES)
def test_values_of_every_size_go_there_and_back(size: int) -> None:
    client = Wire(booted()).client
    client.download(0x2008, 0, pattern(size))
    assert client.upload(0x2008, 0) == pattern(size)
    client.download(0x2008, 0, pattern(size), force_segment=True)
    assert client.upload(0x2008, 0) == pattern(size)


@pytest.mark.parametrize("crc", [True, False])
@pytest.mark.parametrize("size", SIZES)
def test_blocks_of_every_size_go_there_and_back(size: int, crc: bool) -> None:
    client = Wire(booted()).client
    with client.open(
        0x2008, 0, "wb", size=size, block_transfer=True, request_crc_support=crc
    ) as stream:
        stream.write(pattern(size))
    with client.open(0x2008, 0, "rb", block_transfer=True, request_crc_support=crc) as stream:
        assert stream.read() == pattern(size)


@pytest.mark.parametrize("block_size", range(1, 128))
def test_every_block_size_serves(block_size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    bus = booted()
    offer_blocks_of(bus, block_size)
    monkeypatch.setattr(BlockUploadStream, "blksize", block_size)
    client = Wire(bus).client
    with client.open(0x2008, 0, "wb", size=2_000, block_transfer=True) as stream:
        stream.write(pattern(2_000))
    with client.open(0x2008, 0, "rb", block_transfer=True) as stream:
        assert stream.read() == pattern(2_000)


@pytest.mark.parametrize("missing", [1, 2, 3, 60, 126])
def test_a_lost_segment_of_a_block_download_is_repeated(missing: int) -> None:
    bus = booted()
    wire = Wire(bus)
    wire.lost = lambda number: number == 2 + missing
    with wire.client.open(0x2008, 0, "wb", size=5_000, block_transfer=True) as stream:
        stream.write(pattern(5_000))
    assert bus.slave.dictionary[0x2008, 0].data == pattern(5_000)


@pytest.mark.parametrize("missing", range(1, 19))
def test_a_lost_segment_of_a_block_upload_is_repeated(
    missing: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All but the last, the 19th: then the library asks twice, and ends what has ended."""
    monkeypatch.setattr("canopen.sdo.client.time", SimpleNamespace(time=lambda: 0.0))
    bus = booted()
    bus.slave.dictionary[0x2008, 0].value = pattern(130)
    wire = Wire(bus)
    wire.client.RESPONSE_TIMEOUT = 0.01
    wire.lost = lambda number: number == 3 + missing
    with wire.client.open(0x2008, 0, "rb", block_transfer=True) as stream:
        assert stream.read() == pattern(130)


@pytest.mark.parametrize(
    ("index", "data", "code"),
    [
        (0x1000, b"1234", 0x0601_0002),
        (0x2001, b"1", 0x0607_0013),
        (0x2001, b"123", 0x0607_0012),
        (0x2006, b"\xff", 0x0609_0031),
        (0x2007, bytes(65), 0x0607_0012),
        (0x3FFF, b"1", 0x0602_0000),
    ],
)
@pytest.mark.parametrize("segmented", [True, False])
def test_a_refusal_carries_its_abort_code(
    index: int, data: bytes, code: int, segmented: bool
) -> None:
    with pytest.raises(SdoAbortedError) as refused:
        Wire(booted()).client.download(index, 0, data, force_segment=segmented)
    assert refused.value.code == code
