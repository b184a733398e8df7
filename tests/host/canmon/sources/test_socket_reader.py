"""The reader of SocketCAN on a UDP socket, where the kernel stamps and counts just so."""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Iterator

import pytest

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.sources.bus_source import SO_TIMESTAMPNS, SocketReader
from tickrig.wire.can import BRS, ESI, CanFrame, ErrorFrame, FdFrame

PATIENCE_US = 10_000_000
MANY = 40_000


class Bus:
    """An open bus, as far as a reader knows it."""

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)

    def shutdown(self) -> None:
        self.socket.close()


class Sender:
    def __init__(self, bus: Bus) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(bus.socket.getsockname())

    def frame(self, flagged: int, length: int = 0, data: bytes = b"") -> None:
        """Send a struct can_frame (linux/can.h)."""
        self.socket.send(struct.pack("=IB3x8s", flagged, length, data))


@pytest.fixture
def bus() -> Iterator[Bus]:
    bus = Bus()
    yield bus
    bus.shutdown()


@pytest.fixture
def sender(bus: Bus) -> Iterator[Sender]:
    sender = Sender(bus)
    yield sender
    sender.socket.close()


def read(reader: SocketReader, count: int) -> list[Record]:
    records: list[Record] = []
    while len(records) < count:
        batch = reader.read(PATIENCE_US)
        assert batch
        records += batch
    return records


@pytest.mark.realtime
def test_frames_of_every_kind_are_read_with_the_time_of_the_kernel(
    bus: Bus, sender: Sender
) -> None:
    reader, before_us = SocketReader(bus, "can0"), time.time_ns() // 1_000
    sender.frame(0x705, 1, b"\x7f")
    sender.frame(0x8000_0605, 2, b"\x01\x02")
    sender.frame(0x4000_0123, 5)
    sender.frame(0x2000_0088, 8, b"\0\0\1")
    record = read(reader, 4)
    assert [one.frame for one in record] == [
        CanFrame(0x705, b"\x7f"),
        CanFrame(0x605, b"\x01\x02", extended=True),
        CanFrame(0x123, remote=True, remote_length=5),
        ErrorFrame(0x88, b"\0\0\1\0\0\0\0\0"),
    ]
    assert all(0 <= one.at_us - before_us < PATIENCE_US for one in record)
    assert {one.channel for one in record} == {"can0"}


@pytest.mark.realtime
def test_frames_of_can_fd_are_read_and_those_of_can_xl_counted(bus: Bus, sender: Sender) -> None:
    reader = SocketReader(bus, "can0")
    sender.socket.send(struct.pack("=IBB2x64s", 0x123, 64, 0x05, bytes(range(64))))
    sender.socket.send(struct.pack("=IBB2x64s", 0x8000_0123, 12, 0x02, b"\x11"))
    sender.socket.send(struct.pack("=IBBHI", 0x123, 0x80, 0, 2_048, 0) + bytes(2_048))
    sender.frame(0x705)
    assert [one.frame for one in read(reader, 3)] == [
        FdFrame(0x123, bytes(range(64)), flags=BRS),
        FdFrame(0x123, b"\x11" + bytes(11), extended=True, flags=ESI),
        CanFrame(0x705),
    ]
    assert reader.tally.messages("can0") == ["can0: 1 CAN XL frames passed over"]


@pytest.mark.realtime
def test_frames_that_the_kernel_dropped_are_counted(bus: Bus, sender: Sender) -> None:
    reader = SocketReader(bus, "can0")
    for number in range(MANY):
        sender.frame(number % 0x700)
    came = 0
    while batch := reader.read(0):
        came += len(batch)
    sender.frame(0x7FF)
    read(reader, 1)
    assert reader.lost > 0
    assert came + reader.lost == MANY


@pytest.mark.realtime
def test_a_silent_bus_gives_nothing(bus: Bus) -> None:
    assert SocketReader(bus, "can0").read(0) == []
