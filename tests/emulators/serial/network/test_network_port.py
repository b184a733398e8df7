"""The port on the loopback interface of this machine; its time is given."""

from __future__ import annotations

import copy
import gc
import logging
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress

import pytest

from tickrig.emulators.serial.bridge import Bridge
from tickrig.emulators.serial.emulator import SerialHub
from tickrig.emulators.serial.network import (
    LAST_WORDS_US,
    MAX_DISMISSED,
    QUIET_US,
    STUCK_US,
    NetworkPort,
    ServeUrl,
    parse_serve_url,
)
from tickrig.emulators.serial.serial_line import SerialLine

pytestmark = pytest.mark.realtime

PATIENCE_S = 10.0
SET_9600 = b"\xff\xfa\x2c\x01\x00\x00\x25\x80\xff\xf0"
IS_9600 = b"\xff\xfa\x2c\x65\x00\x00\x25\x80\xff\xf0"


@contextmanager
def served(scheme: str = "socket", buffer_bytes: int = 4_096) -> Iterator[NetworkPort]:
    with closing(NetworkPort(ServeUrl(scheme), buffer_bytes)) as port:
        yield port


def connected(port: NetworkPort) -> socket.socket:
    return socket.create_connection((port.address, port.port), timeout=PATIENCE_S)


def until(port: NetworkPort, done: Callable[[bytes], bool], now_us: int = 0) -> bytes:
    """Poll until it is so: the kernel passes things on when it gets to it."""
    received, deadline = b"", time.monotonic() + PATIENCE_S
    while not done(received):
        assert time.monotonic() < deadline, received
        received += port.poll(now_us)
    return received


def greeted(port: NetworkPort, now_us: int = 0) -> socket.socket:
    """Connect, and wait until the port has this host."""
    host = connected(port)
    host.send(b"#")
    until(port, lambda received: received.endswith(b"#"), now_us)
    return host


def test_bytes_pass_as_they_are_both_ways_and_the_url_says_where() -> None:
    every = bytes(range(256))
    with served() as port, greeted(port) as host:
        assert port.url == f"socket://127.0.0.1:{port.port}"
        host.send(every)
        assert until(port, lambda received: len(received) == 256) == every
        port.send(0, every)
        assert host.recv(1_000) == every
        assert port.host_setting == ""


def test_what_is_sent_without_a_host_is_gone_and_not_lost() -> None:
    with served() as port:
        port.send(0, b"EV:Initialized\n")
        with greeted(port) as host:
            port.send(0, b"EV:PowerOn\n")
            assert host.recv(1_000) == b"EV:PowerOn\n"
        assert port.lost == 0


def test_a_second_host_is_told_and_left_and_the_first_stays(
    caplog: pytest.LogCaptureFixture,
) -> None:
    with served() as port, greeted(port) as host:
        first = "{}:{}".format(*host.getsockname())
        for _ in range(2):
            with connected(port) as second:
                second.send(b"x")
                second.setblocking(False)
                told = b""
                while not told.endswith(b"\r\n"):
                    assert port.poll(0) == b""
                    try:
                        told += second.recv(1_000)
                    except BlockingIOError:
                        continue
                assert told.decode() == f"{port.url} has a host already: {first}\r\n"
        port.send(0, b"still there")
        assert host.recv(100) == b"still there"
        assert len(caplog.records) == 1
        with connected(port):
            until(port, lambda _: len(caplog.records) > 1, QUIET_US)
    for record in caplog.records:
        assert record.getMessage().startswith(f"{port.url} has a host already: {first}; 127.0.0.1:")


def test_of_many_hosts_that_were_refused_few_are_kept() -> None:
    with served() as port, greeted(port), ExitStack() as stack:
        refused = [stack.enter_context(connected(port)) for _ in range(2 * MAX_DISMISSED)]
        for _ in range(1_000):
            port.poll(0)
        assert refused[-1].recv(100).startswith(port.url.encode())
        with pytest.raises(ConnectionError):
            send_on(refused[0])


def has_ipv6() -> bool:
    try:
        socket.create_server(("::1", 0), family=socket.AF_INET6).close()
    except OSError:
        return False
    return True


def send_on(host: socket.socket) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        host.send(b"let me in\n")
        time.sleep(0.001)


@pytest.mark.parametrize("last", [b"", b"x" * 5_000])
def test_the_next_host_is_taken_when_all_of_the_last_one_was(last: bytes) -> None:
    with served() as port:
        host = greeted(port)
        host.sendall(last)
        host.close()
        with connected(port) as host:
            host.send(b"#")
            assert until(port, lambda received: received.endswith(b"#")) == last + b"#"


def negotiated(host: socket.socket, look: Callable[[], object]) -> None:
    """Look until a setting of the host is answered; it has asked for it."""
    host.setblocking(False)
    answer, deadline = b"", time.monotonic() + PATIENCE_S
    while not answer.endswith(IS_9600):
        assert time.monotonic() < deadline, answer
        look()
        with suppress(BlockingIOError):
            answer += host.recv(1_000)
    host.settimeout(PATIENCE_S)


def test_the_next_host_negotiates_while_bytes_of_the_last_one_are_still_to_be_taken() -> None:
    with served("rfc2217") as port:
        host = greeted(port)
        host.send(b"x" * 20_000)
        host.close()
        port.poll(0)  # it is not idle: the first kilobyte of its bytes
        with connected(port) as host:
            host.send(SET_9600 + b"#")
            negotiated(host, lambda: port.attend(0))
            assert port.host_setting == ""
            assert until(port, lambda received: b"#" in received).strip(b"x") == b"#"
            port.send(0, b"hello")
            assert host.recv(100) == b"hello"


def test_the_next_host_negotiates_while_the_line_is_full() -> None:
    line = SerialLine(baud=300)
    with served("rfc2217") as port, greeted(port) as last:
        bridge = Bridge(line.b, port, port.attend)
        last.send(b"x" * 8_000)
        while line.b.room(0):
            bridge.take_in(0)
        bridge.take_in(0)
        last.close()
        with connected(port) as host:
            host.send(SET_9600)
            negotiated(host, lambda: bridge.take_in(0))


def test_a_host_that_comes_while_another_has_still_to_be_heard_is_refused_in_the_end() -> None:
    with served() as port, greeted(port) as first:
        first.send(b"x" * 3_000)
        with connected(port) as second:
            second.send(b"let me in")
            received = until(port, lambda received: len(received) == 3_000)
            told = f"{port.url} has a host already: {{}}:{{}}\r\n".format(*first.getsockname())
            received += until(port, lambda _: not port.poll(0) and bool(port._dismissed))
            assert second.recv(1_000).decode() == told
            assert received == b"x" * 3_000


def test_a_host_that_has_not_waited_for_the_line_makes_room_for_others() -> None:
    with served("rfc2217") as port, greeted(port) as first:
        first.send(b"x" * 3_000)
        port.poll(0)
        with connected(port):
            port.attend(0)
        with connected(port) as host:
            host.send(SET_9600)
            negotiated(host, lambda: port.attend(0))


def test_a_host_that_ended_its_sending_is_answered_for_a_while() -> None:
    with served() as port, connected(port) as host:
        host.send(b"device\n")
        host.shutdown(socket.SHUT_WR)
        until(port, lambda received: received == b"device\n")
        port.poll(0)
        port.send(0, b"RRC\n")
        assert host.recv(100) == b"RRC\n"
        for late_us in range(LAST_WORDS_US, 20 * LAST_WORDS_US, LAST_WORDS_US):
            port.poll(late_us)  # the end may be there only at the second look
        assert host.recv(100) == b""


def test_a_host_that_does_not_read_loses_bytes_and_in_the_end_the_line() -> None:
    with served(buffer_bytes=1_000) as port, greeted(port) as host:
        host.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)
        while not port.lost:
            port.send(0, bytes(1_000))
            port.poll(0)
        with connected(port) as second:
            second.send(b"#")
            until(port, lambda received: received == b"#", STUCK_US)
            lost = port.lost
            port.send(STUCK_US, b"hello")
            assert second.recv(100) == b"hello"
    assert port.lost == lost >= 1_000


def test_a_host_that_resets_its_connection_makes_room() -> None:
    with served() as port:
        host = greeted(port)
        host.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        host.close()
        port.send(0, b"into the void")
        greeted(port).close()


def test_a_setting_that_is_not_the_devices_is_told_once_and_gone_with_its_host() -> None:
    told: list[str] = []
    with served("rfc2217") as port:
        port.watch_setting(115_200, told.append)
        for number in range(2):
            now_us = number * 10_000_000
            with greeted(port, now_us) as host:
                assert port.host_setting == ""
                host.send(SET_9600 + b"#")
                until(port, lambda received: received == b"#", now_us)
                port.poll(now_us + 1_000_000)
                assert port.host_setting == "9600 8N1"
            until(port, lambda received: not port.host_setting, now_us + 9_000_000)
    assert told == ["9600 8N1"]


def test_a_device_on_usb_takes_any_setting() -> None:
    with served("rfc2217") as port:
        port.watch_setting(12_000_000, pytest.fail)
        with greeted(port) as host:
            host.send(SET_9600 + b"#")
            until(port, lambda received: received == b"#")
            port.poll(1_000_000)
            assert port.host_setting == ""


def test_a_host_whose_telnet_is_none_is_told_and_left(caplog: pytest.LogCaptureFixture) -> None:
    with served("rfc2217") as port, greeted(port) as host:
        host.send(b"\xff\xf0")
        until(port, lambda _: bool(caplog.records))
        received = b""
        while data := host.recv(1_000):
            received += data
        assert received.endswith(b"IAC SE without IAC SB\r\n")
        (record,) = caplog.records
        assert record.levelno == logging.WARNING
        assert record.getMessage().endswith(" was dropped: IAC SE without IAC SB")
        greeted(port).close()


@pytest.mark.parametrize("place", ["0.0.0.0:0", "[::]:0", "[::1]:0", "127.0.0.1:0"])
def test_a_port_open_to_others_is_warned_of_and_says_where_this_machine_finds_it(
    place: str, caplog: pytest.LogCaptureFixture
) -> None:
    if "[" in place and not has_ipv6():
        pytest.skip("this machine has no IPv6")
    with closing(NetworkPort(parse_serve_url(f"socket://{place}"))) as port:
        assert port.address == place.rpartition(":")[0].strip("[]")
        host, _, number = port.url.removeprefix("socket://").rpartition(":")
        assert (host, int(number)) in [("127.0.0.1", port.port), ("[::1]", port.port)]
        warned = [record.getMessage() for record in caplog.records]
    open_to_others = f"Anyone who reaches port {port.port} of {port.address} can drive this device"
    assert [text.startswith(open_to_others) for text in warned] == [True] * ("1" not in place)


def test_a_port_that_is_taken_is_free_again_after_close() -> None:
    with served() as port, greeted(port):
        url = parse_serve_url(port.url)
        with pytest.raises(OSError, match=f"in use: '{url}'"):
            NetworkPort(url)
    NetworkPort(url).close()


@pytest.mark.parametrize("host", ["a..b", "x" * 70, "192.0.2.1"])
def test_a_host_that_is_none_of_this_machine_is_an_error(host: str) -> None:
    with pytest.raises(OSError):  # noqa: PT011 - each system has its own words
        NetworkPort(ServeUrl("socket", host))
    gc.collect()  # a socket left open would be told by pytest


def test_it_cannot_be_copied() -> None:
    with served() as port, pytest.raises(TypeError, match="it is a TCP port of this machine"):
        copy.deepcopy(port)


def test_on_a_hub_every_host_hears_the_device_and_may_send() -> None:
    with served() as first, served("rfc2217") as second, greeted(first) as one:
        hub = SerialHub([first, second])
        with greeted(second) as other:
            received = other.recv(1_000)
            one.send(b"a" * 10)
            other.send(b"b" * 10)
            got, deadline = b"", time.monotonic() + PATIENCE_S
            while len(got) < 20 and time.monotonic() < deadline:
                got += hub.poll(0)
            assert sorted(got) == sorted(b"a" * 10 + b"b" * 10)
            hub.send(0, b"RRC\n")
            assert one.recv(100) == b"RRC\n"
            while not received.endswith(b"RRC\n"):
                received += other.recv(1_000)
            second.watch_setting(57_600, lambda setting: None)
            hub.poll(1_000_000)
            assert (hub.host_setting, hub.lost) == ("115200 8N1", 0)
