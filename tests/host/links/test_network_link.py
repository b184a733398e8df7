"""`SerialLink` over TCP: servers that are silent, busy, slow, stopped, gone and back."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager

import pytest

from tests.host.live import served
from tickrig.emulators.serial.network import NetworkPort, Rfc2217Connection, parse_serve_url
from tickrig.host.links.link import LinkClosed, ReopeningLink
from tickrig.host.links.serial_link import SerialLink, tune
from tickrig.wire.uart import UartSetting

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.filterwarnings("ignore:set:DeprecationWarning"),  # of pyserial's own thread
]


@contextmanager
def polled(port: NetworkPort) -> Iterator[Callable[[], None]]:
    """Let a port serve in a thread of its own, until it is stopped."""
    done = threading.Event()

    def poll() -> None:
        while not done.wait(0.001):
            port.send(0, port.poll(0))

    thread = threading.Thread(target=poll)

    def stop() -> None:
        done.set()
        if thread.is_alive():
            thread.join()

    thread.start()
    try:
        yield stop
    finally:
        stop()


def connected(port: NetworkPort) -> socket.socket:
    return socket.create_connection((port.address, port.port))


def answer(link: SerialLink | ReopeningLink[bytes], size: int) -> bytes:
    received = b""
    while len(received) < size:
        more = link.receive(10_000_000)
        assert more
        received += more
    return received


@pytest.mark.parametrize("scheme", ["rfc2217", "socket"])
def test_every_byte_comes_back_as_it_was_sent(scheme: str) -> None:
    every = bytes(range(256)) * 8
    with served(scheme) as port, polled(port), closing(SerialLink(port.url)) as link:
        link.send(every)
        assert answer(link, len(every)) == every
        assert link.receive(0) == b""


def test_a_wait_asks_nothing_of_the_other_end() -> None:
    """pyserial's own would negotiate a change of time-out, and fail after 3 s."""
    with served("rfc2217") as port, polled(port) as stop, closing(SerialLink(port.url)) as link:
        stop()
        for wait_us in (0, 1_000, 2_000, 0):
            assert link.receive(wait_us) == b""


def test_a_busy_port_says_who_has_it() -> None:
    with served("rfc2217") as port, polled(port), connected(port) as first:
        first.recv(1)
        own = "{}:{}".format(*first.getsockname())
        url = f"{port.url}?timeout=1"
        with pytest.raises(LinkClosed) as refused:
            SerialLink(url)
    assert str(refused.value) == (
        f"cannot open '{url}': no serial server answers there:"
        f" it said '{port.url} has a host already: {own}'"
    )


def test_a_server_that_is_silent_is_told() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        url = "rfc2217://{}:{}?timeout=0.1".format(*server.getsockname())
        with pytest.raises(LinkClosed, match="no serial server answers there: it said nothing"):
            SerialLink(url)


@pytest.mark.parametrize("scheme", ["rfc2217", "socket"])
def test_what_came_before_the_end_is_read_first(scheme: str) -> None:
    with served(scheme) as port, polled(port) as stop:
        link = SerialLink(port.url)
        link.send(b"#")
        assert answer(link, 1) == b"#"
        stop()
        port.send(0, b"last words")
    with closing(link):
        assert answer(link, 10) == b"last words"
        for _ in range(2):
            with pytest.raises(LinkClosed, match="cannot read from"):
                link.receive(10_000_000)


@pytest.mark.parametrize("scheme", ["rfc2217", "socket"])
def test_a_server_that_takes_nothing_is_as_one_that_is_gone(scheme: str) -> None:
    with served(scheme) as port, polled(port) as stop, closing(SerialLink(port.url)) as link:
        stop()
        with pytest.raises(LinkClosed, match="cannot write to"):
            link.send(bytes(20_000_000))


def test_what_is_no_telnet_ends_a_link_without_a_traceback(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    failed: list[threading.ExceptHookArgs] = []
    monkeypatch.setattr(threading, "excepthook", failed.append)
    opened = threading.Event()

    def serve(server: socket.socket) -> None:
        host = Rfc2217Connection(server.accept()[0], 4_096, UartSetting())
        while not opened.wait(0.001):
            host.poll(0)
        host.connection.send(b"EV:Alarm\n\xff\xf0")
        host.close()

    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=serve, args=[server])
        thread.start()
        with closing(SerialLink("rfc2217://{}:{}".format(*server.getsockname()))) as link:
            opened.set()
            assert answer(link, 9) == b"EV:Alarm\n"
            with pytest.raises(LinkClosed, match="the connection has ended"):
                link.receive(10_000_000)
        thread.join()
    assert not failed


@pytest.mark.parametrize("scheme", ["rfc2217", "socket"])
def test_nobody_there_is_told_in_few_words(scheme: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        number = server.getsockname()[1]
    url = f"{scheme}://127.0.0.1:{number}"
    with pytest.raises(LinkClosed) as refused:
        SerialLink(url)
    assert str(refused.value) == f"cannot open '{url}': Connection refused"


def test_a_host_without_a_name_is_told_in_few_words() -> None:
    with pytest.raises(LinkClosed) as refused:
        SerialLink("socket://no-such-host.invalid:7000")
    assert "Could not open port" not in str(refused.value)


def test_a_line_that_was_cut_is_opened_again() -> None:
    with served("socket") as port, polled(port):
        url = port.url
        link = ReopeningLink(lambda: SerialLink(url))
        link.send(b"one")
        assert answer(link, 3) == b"one"
    with closing(link):
        with pytest.raises(LinkClosed, match="cannot read from"):
            link.receive(10_000_000)
        with pytest.raises(LinkClosed, match="Connection refused"):
            link.send(b"nobody")
        with closing(NetworkPort(parse_serve_url(url))) as port, polled(port):
            link.send(b"two")
            assert answer(link, 3) == b"two"


def test_a_connection_sends_at_once_and_looks_for_its_other_end() -> None:
    with served("socket") as port, connected(port) as connection:
        tune(connection)
        assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
        assert connection.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)


def test_the_connections_of_links_are_so(monkeypatch: pytest.MonkeyPatch) -> None:
    tuned: list[socket.socket] = []
    monkeypatch.setattr("tickrig.host.links.serial_link.tune", tuned.append)
    SerialLink("loop://").close()
    assert not tuned
    for scheme in ("rfc2217", "socket"):
        with served(scheme) as port, polled(port), closing(SerialLink(port.url)):
            assert len(tuned) == 1
            tuned.clear()
