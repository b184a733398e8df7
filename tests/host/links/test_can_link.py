"""The CAN link on python-can's virtual bus: real time, but nothing to wait for."""

from __future__ import annotations

import errno
import os
import socket
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress

import can
import pytest

from tests.emulators.can.can_bench import frames
from tests.host.links.slcan_adapter import Adapter
from tickrig.emulators.can.outside.bus_port import CanBusPort
from tickrig.host.canmon.sources.bus_source import BusReader
from tickrig.host.links.can_link import MOST_FAULTS, CanLink, prepare_bus, to_frame, to_message
from tickrig.host.links.link import LinkClosed
from tickrig.wire.can import CanFrame, ErrorState


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


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give a bus up when enough reads have failed, however short that lasted."""
    monkeypatch.setattr("tickrig.host.links.can_link.FAULTY_S", 0.0)


def until_gone(read: Callable[[], object]) -> str:
    try:
        for _ in range(MOST_FAULTS):
            read()
    except LinkClosed as error:
        return str(error)
    raise AssertionError("it is read for ever")


@pytest.mark.usefixtures("impatient")
def test_a_driver_that_fails_each_time_ends_what_reads_it() -> None:
    why = "bad:0: the last 100 reads have failed: AttributeError"
    link = CanLink(BadDriver("bad"), "bad:0")
    assert until_gone(lambda: link.receive(0)) == f"cannot read from {why}"
    assert link.reads.faults == 0
    reader = BusReader(BadDriver("bad"), "bad", "bad:0")
    assert until_gone(lambda: reader.read(1_000)) == why
    assert reader.tally.messages("bad:0") == []
    port = CanBusPort(BadDriver("bad"), "bad:0")
    assert until_gone(lambda: port.poll(0)) == why


ERRORS = (
    IndexError("string index out of range"),
    ValueError("non-hexadecimal number found in fromhex()"),
    struct.error("unpack requires a buffer of 16 bytes"),
    TypeError("'NoneType' object is not subscriptable"),
    can.CanOperationError("the driver has lost its place"),
    OSError("an overrun"),
    ZeroDivisionError(),
)


class Hiccups(BadDriver):
    """A driver that raises something else before each frame."""

    def __init__(self) -> None:
        super().__init__("hiccups")
        came = ((error, to_message(frames("080#")[0])) for error in ERRORS)
        self._came = iter([one for pair in came for one in pair])

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        one = next(self._came, None)
        if isinstance(one, Exception):
            raise one
        return one, False


def test_a_driver_that_fails_now_and_then_is_read_on(caplog: pytest.LogCaptureFixture) -> None:
    link = CanLink(Hiccups(), "bad:0")
    assert link.receive(0) == frames("080#") * len(ERRORS)
    assert link.reads.faults == len(ERRORS)
    first = "bad:0: a read has failed: IndexError: string index out of range; what came is lost"
    assert caplog.messages == [first]
    reader = BusReader(Hiccups(), "bad", "bad:0")
    assert len(reader.read(0)) == len(ERRORS)
    said = "bad:0: 7 frames that the driver could not read passed over"
    assert reader.tally.messages("bad:0") == [said]
    port = CanBusPort(Hiccups(), "bad:0")
    assert port.poll(0) == frames("080#") * len(ERRORS)
    assert port.failed == ""


@pytest.mark.parametrize("code", [errno.ENODEV, errno.ENETDOWN])
def test_an_adapter_that_the_kernel_calls_gone_is_gone_at_once(code: int) -> None:
    class Gone(BadDriver):
        def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
            raise can.CanOperationError("it is gone", code)

    with pytest.raises(LinkClosed, match="cannot read from bad:0: it is gone"):
        CanLink(Gone("gone"), "bad:0").receive(0)


CUT = (b"t12", b"tXYZ1AA", b"t1234AABB", b"tF051AA", b"t1239001122334455667788")
"""Lines of which something was lost, or changed."""
BINARY = (b"\xff\xfe", b"t1\xe92")
"""After a line that is no text all that waits is dropped."""


@pytest.fixture
def adapter() -> Iterator[tuple[Adapter, can.BusABC]]:
    adapter = Adapter()
    bus = adapter.open()
    yield adapter, bus
    with suppress(can.CanError, OSError):
        bus.shutdown()


def heard_of(adapter: Adapter, read: Callable[[], Iterable[object]]) -> list[object]:
    """Return what is read of two good frames with bad lines between them."""
    for line in (b"t70517F", *CUT, *BINARY):
        adapter.send(line + b"\r")
    heard: list[object] = []
    deadline = time.monotonic() + 10
    while "706#05" not in map(str, heard):
        adapter.send(b"t706105\r")  # what comes behind a line that is no text may be lost with it
        heard += read()
        assert time.monotonic() < deadline, heard
    return heard[:2]


@pytest.mark.realtime
def test_cut_lines_of_an_adapter_are_counted_and_the_rest_is_read(
    adapter: tuple[Adapter, can.BusABC],
) -> None:
    port, bus = adapter
    link = CanLink(bus, port.name)
    heard = heard_of(port, lambda: link.receive(10_000))
    assert list(map(str, heard)) == ["705#7F", "706#05"]
    assert link.reads.faults > len(CUT)


@pytest.mark.realtime
def test_cut_lines_of_an_adapter_do_not_end_canmon(adapter: tuple[Adapter, can.BusABC]) -> None:
    port, bus = adapter
    reader = BusReader(bus, "slcan", port.name)
    heard_of(port, lambda: (record.frame for record in reader.read(10_000)))
    (said,) = reader.tally.messages(port.name)
    assert said.endswith(" frames that the driver could not read passed over")


@pytest.mark.realtime
def test_cut_lines_of_an_adapter_do_not_end_an_emulator(
    adapter: tuple[Adapter, can.BusABC],
) -> None:
    port, bus = adapter
    outside = CanBusPort(bus, port.name)
    assert list(map(str, heard_of(port, lambda: outside.poll(0)))) == ["705#7F", "706#05"]
    assert outside.reads.faults > len(CUT)


@pytest.mark.realtime
def test_an_adapter_that_is_unplugged_ends_what_reads_it(
    adapter: tuple[Adapter, can.BusABC],
) -> None:
    port, bus = adapter
    link = CanLink(bus, port.name)
    port.unplug()
    deadline = time.monotonic() + 30
    why = ""
    while not why and time.monotonic() < deadline:
        try:
            link.receive(10_000)
        except LinkClosed as error:
            why = str(error)
    assert why.startswith(f"cannot read from {port.name}: the last ")


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


class Daemon:
    """A socketcand of one client."""

    def __init__(self) -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self._thread = threading.Thread(target=self._greet, daemon=True)
        self._thread.start()

    def _greet(self) -> None:
        self._client, _ = self._server.accept()
        for said in ("< hi >", "< ok >", "< ok >"):
            self._client.sendall(said.encode())
            if said != "< hi >":
                continue
            self._client.recv(100)

    def open(self) -> can.BusABC:
        port = self._server.getsockname()[1]
        bus = can.Bus(interface="socketcand", host="127.0.0.1", port=port, channel="can0")
        prepare_bus(bus, "socketcand")
        self._thread.join()
        return bus

    def send(self, text: str) -> None:
        self._client.sendall(text.encode())

    def close(self) -> None:
        self._client.close()
        self._server.close()


@pytest.mark.realtime
def test_a_bad_frame_of_socketcand_is_told_in_a_line_and_what_follows_is_read(
    caplog: pytest.LogCaptureFixture,
) -> None:
    daemon = Daemon()
    link = CanLink(daemon.open(), "socketcand:can0")
    daemon.send("< frame 705 1.0 7F >< frame 123 1.0 XY >")
    heard: list[CanFrame] = []
    deadline = time.monotonic() + 10
    while not link.reads.faults and time.monotonic() < deadline:
        heard += link.receive(1_000)
    daemon.send("< frame 706 1.0 05 >")
    while len(heard) < 2 and time.monotonic() < deadline:
        heard += link.receive(1_000)
    assert list(map(str, heard)) == ["705#7F", "706#05"]
    said = [text for text in caplog.messages if text.startswith("socketcand:can0")]
    assert len(said) == 1
    assert said[0].startswith(
        "socketcand:can0: a read has failed: Failed to receive: non-hexadecimal"
    )
    assert "Traceback" not in caplog.text
    link.close()
    daemon.close()


@pytest.mark.usefixtures("impatient")
def test_a_traceback_in_the_text_of_an_error_is_not_told() -> None:
    class Chatty(BadDriver):
        def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
            raise can.CanError(
                "it\nfailed:  Traceback (most recent call last):\n  File x\nKeyError"
            )

        def send(self, msg: can.Message, timeout: float | None = None) -> None:
            self._recv_internal(None)

    link = CanLink(Chatty("chatty"), "bad:0")
    assert until_gone(lambda: link.receive(0)).endswith("reads have failed: it failed:")
    with pytest.raises(LinkClosed, match=r"cannot send on bad:0: it failed:$"):
        link.send(frames("080#"))


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
