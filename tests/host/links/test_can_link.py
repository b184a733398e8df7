"""The CAN link on python-can's virtual bus: real time, but nothing to wait for."""

from __future__ import annotations

import errno
import os
import socket
import sys
from collections.abc import Callable, Iterator

import can
import pytest

from tests.emulators.can.can_bench import frames
from tickrig.emulators.can.outside.bus_port import CanBusPort
from tickrig.host.canmon.sources.bus_source import BusReader
from tickrig.host.links.can_link import CanLink, prepare_bus
from tickrig.host.links.can_message import to_frame, to_message
from tickrig.host.links.errors import LinkClosed
from tickrig.wire.can_error import ErrorState


@pytest.fixture
def other() -> Iterator[can.BusABC]:
    with can.Bus(interface="virtual", channel="can_link") as bus:
        yield bus


def test_frames_go_both_ways(other: can.BusABC) -> None:
    link = CanLink.open("can_link", "virtual", bit_rate=500_000)
    link.send(frames("601#4000100000000000 00000605#R8"))
    received = [other.recv(1), other.recv(1)]
    assert tuple(to_frame(m) for m in received if m) == frames("601#4000100000000000 00000605#R8")
    for frame in frames("581#4300100092010000 705#7F"):
        other.send(to_message(frame))
    assert link.receive(1_000_000) == frames("581#4300100092010000 705#7F")
    link.close()


def test_silence_ends_with_the_timeout(other: can.BusABC) -> None:
    link = CanLink.open("can_link", "virtual")
    before_us = link.now_us
    assert link.receive(2_000) == ()
    assert link.now_us >= before_us + 2_000
    link.close()


def test_error_frames_and_fd_frames_are_passed_over(other: can.BusABC) -> None:
    link = CanLink.open("can_link", "virtual")
    other.send(can.Message(is_error_frame=True))
    other.send(can.Message(is_fd=True, data=bytes(12)))
    other.send(to_message(frames("080#")[0]))
    assert link.receive(1_000_000) == frames("080#")
    link.close()


def test_a_closed_link_says_so(other: can.BusABC) -> None:
    link = CanLink.open("can_link", "virtual")
    link.close()
    link.close()
    with pytest.raises(LinkClosed, match="cannot send on virtual:can_link"):
        link.send(frames("080#"))
    with pytest.raises(LinkClosed, match="cannot read from virtual:can_link"):
        link.receive(0)


class BadDriver(can.BusABC):
    """A driver of somebody else, with a fault of its own."""

    def __init__(self, channel: str) -> None:
        super().__init__(channel)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        raise AttributeError

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        raise AssertionError


def test_a_fault_of_a_driver_is_told_as_one_of_the_bus() -> None:
    link = CanLink(BadDriver("bad"), "bad:0")
    with pytest.raises(LinkClosed, match="cannot read from bad:0: AttributeError"):
        link.receive(0)
    reader = BusReader(BadDriver("bad"), "bad", "bad:0")
    with pytest.raises(LinkClosed, match="bad:0: AttributeError"):
        reader.read(0)


class Silent(can.BusABC):
    """A driver that has nothing.

    Attributes:
        waits: how often it was to wait.
    """

    def __init__(self, channel: str) -> None:
        super().__init__(channel)
        self.waits = 0

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        assert timeout is not None
        assert timeout <= MOST_S
        self.waits += 1
        return None, False

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        raise AssertionError


MOST_S = 0.002
READS: list[tuple[str, Callable[[can.BusABC], object]]] = [
    ("a link", lambda bus: CanLink(bus, "silent:0").receive(2_000)),
    ("canmon", lambda bus: BusReader(bus, "silent", "silent:0").read(2_000)),
    ("an emulator", lambda bus: CanBusPort(bus).poll(0)),
]


@pytest.mark.realtime
@pytest.mark.parametrize("read", [read for _, read in READS], ids=[name for name, _ in READS])
def test_a_wall_clock_that_is_set_back_prolongs_no_wait(
    read: Callable[[can.BusABC], object], monkeypatch: pytest.MonkeyPatch
) -> None:
    bus = Silent("silent")
    monkeypatch.setattr("can.bus.time", lambda: -3_600 * bus.waits)
    read(bus)
    assert bus.waits


def test_a_bus_that_cannot_be_opened_is_told() -> None:
    with pytest.raises(LinkClosed, match="cannot open nonsense:can0"):
        CanLink.open("can0", "nonsense")


@pytest.mark.parametrize(
    ("error", "data", "state"),
    [
        (0x040, b"", ErrorState.BUS_OFF),
        (0x100, b"", ErrorState.ACTIVE),
        (0x004, b"\0\x20", ErrorState.PASSIVE),
        (0x004, b"\0\x10", ErrorState.PASSIVE),
        (0x004, b"\0\x40", ErrorState.ACTIVE),
        (0x004, b"\0\x08", None),
        (0x004, b"", None),
        (0x020, bytes(8), None),
    ],
)
def test_an_error_frame_tells_the_error_state(
    other: can.BusABC, error: int, data: bytes, state: ErrorState | None
) -> None:
    link, told = CanLink.open("can_link", "virtual"), list[ErrorState]()
    link.on_error_state = told.append
    other.send(can.Message(is_error_frame=True, arbitration_id=error, data=data))
    other.send(to_message(frames("080#")[0]))
    link.receive(1_000_000)
    assert told == ([] if state is None else [state])
    link.close()


class FullBus(can.BusABC):
    """A bus that takes nothing, as one without another node does in the end."""

    def __init__(self, code: int | None) -> None:
        super().__init__(channel="full")
        self._code = code

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        raise can.CanOperationError("Transmit buffer full", self._code)


@pytest.mark.parametrize("code", [None, errno.ENOBUFS])
def test_a_link_that_drops_goes_on_when_the_bus_takes_nothing(code: int | None) -> None:
    link = CanLink(FullBus(code), "full", drops=True)
    link.send(frames("080# 080#"))
    assert link.lost == 2
    link.close()


class NarrowBus(FullBus):
    """A bus whose queue has room now and then, as SocketCAN's of ten frames."""

    def __init__(self) -> None:
        super().__init__(errno.ENOBUFS)
        self.taken: list[int] = []
        self._calls = 0

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self._calls += 1
        if self._calls % 3:
            super().send(msg, timeout)
        self.taken.append(msg.arbitration_id)


def test_a_queue_without_room_is_waited_for() -> None:
    bus = NarrowBus()
    link = CanLink(bus, "narrow")
    link.send(frames("080# 081# 082#"))
    assert bus.taken == [0x80, 0x81, 0x82]
    link.close()


@pytest.mark.parametrize(("code", "drops"), [(errno.ENETDOWN, True), (None, False)])
def test_a_bus_that_is_gone_ends_it(code: int | None, drops: bool) -> None:
    link = CanLink(FullBus(code), "full", drops=drops)
    with pytest.raises(LinkClosed, match="cannot send on full: Transmit buffer full"):
        link.send(frames("080#"))
    link.close()


@pytest.mark.realtime
@pytest.mark.skipif(sys.platform != "linux", reason="the queue is that of Linux")
def test_a_bus_keeps_more_than_the_usual_while_nobody_reads() -> None:
    with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as usual:
        usual_bytes = usual.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
    with can.Bus(interface="udp_multicast", channel="ff11::7469:626b", hop_limit=0) as bus:
        prepare_bus(bus, "udp_multicast")
        with socket.socket(fileno=os.dup(bus.fileno())) as sock:
            assert sock.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) > usual_bytes
