"""Requests over HTTP: to the service, and to servers that hang, lie or talk without end."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing

import pytest

from tests.host.rtc.ucode.bench import DOOR, NOBODY
from tickrig.emulators.tkernel.commands.http_service import HttpService
from tickrig.emulators.tkernel.resolution import ResolutionService
from tickrig.emulators.tkernel.ucode_table import EXAMPLE, parse_table
from tickrig.host.rtc.ucode.cache import Fetched, SourceStatus
from tickrig.host.rtc.ucode.http_source import MOST_OCTETS, HttpSource

pytestmark = pytest.mark.realtime

DEADLINE_S = 30.0
HOSTS = ("127.0.0.1",)


@pytest.fixture
def service() -> ResolutionService:
    return ResolutionService(parse_table(EXAMPLE), "")


@pytest.fixture
def http(service: ResolutionService) -> Iterator[HttpService]:
    with closing(HttpService(service)) as http:
        yield http


def fetch(source: HttpSource, address: str) -> Fetched:
    source.request(address, 0)
    deadline_s = time.monotonic() + DEADLINE_S
    while time.monotonic() < deadline_s:
        if ended := source.take(0):
            return ended[0]
        threading.Event().wait(0.002)
    raise AssertionError("no end")


def get(address: str, timeout_s: float = 20.0) -> Fetched:
    with closing(HttpSource("test", HOSTS, timeout_s)) as source:
        return fetch(source, address)


@contextlib.contextmanager
def server(talk: Callable[[socket.socket], object]) -> Iterator[str]:
    """Accept one connection, and do with it what somebody wants."""
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve() -> None:
            with contextlib.suppress(OSError):
                connection, _ = listener.accept()
                with connection:
                    connection.recv(4_096)
                    talk(connection)

        threading.Thread(target=serve, daemon=True).start()
        yield f"http://127.0.0.1:{listener.getsockname()[1]}/x"


def test_a_ucode_leads_to_what_is_there(http: HttpService) -> None:
    settled = get(f"{http.url}/ucodes/{DOOR}")
    assert settled.status is SourceStatus.FOUND
    assert settled.text == f"{http.url}/contents/door"
    assert '"name": "door of room 1"' in get(settled.text).text


@pytest.mark.parametrize("path", [f"/ucodes/{NOBODY}", "/", "/contents/../x", "/contents/nobody"])
def test_what_is_not_there_is_unknown(http: HttpService, path: str) -> None:
    assert get(http.url + path).status is SourceStatus.UNKNOWN


def test_an_unreachable_service_is_found_again(
    http: HttpService, service: ResolutionService
) -> None:
    address = f"{http.url}/ucodes/{DOOR}"
    service.inputs.set("unreachable", 1)
    http.follow()
    lost = get(address)
    assert (lost.status, "refused" in lost.text) == (SourceStatus.FAILED, True)
    service.inputs.set("unreachable", 0)
    http.follow()
    assert get(address).status is SourceStatus.FOUND


def test_a_slow_service_fails_at_the_time_out(
    http: HttpService, service: ResolutionService
) -> None:
    service.inputs.set("slow", 1)
    service.inputs.set("delay_ms", 60_000)
    slow = get(f"{http.url}/ucodes/{DOOR}", 0.05)
    assert (slow.status, slow.text.endswith("timed out")) == (SourceStatus.FAILED, True)


def drip(connection: socket.socket) -> None:
    """Say something now and then, without an end."""
    while True:
        connection.sendall(b"H")
        threading.Event().wait(0.01)


@pytest.mark.parametrize(
    ("talk", "told"),
    [
        (drip, "timed out"),
        (lambda c: c.sendall(b"H" * 2 * MOST_OCTETS), "more than 8192 octets"),
        (lambda c: c.sendall(b"SSH-2.0-x\r\n"), "SSH-2.0-x"),
        (lambda c: None, "without response"),
        (lambda c: c.sendall(b"HTTP/1.0 200 OK\r\nContent-Length: 9\r\n\r\nabc"), "IncompleteRead"),
        (lambda c: c.sendall(b"HTTP/1.0 302 Found\r\nLocation: /y\r\n\r\n"), "HTTP status 302"),
        (lambda c: c.sendall(b"HTTP/1.0 200 OK\r\n\r\n\xff"), "utf-8"),
    ],
)
def test_an_answer_that_is_none_is_a_failure(
    talk: Callable[[socket.socket], object], told: str
) -> None:
    with server(talk) as address:
        failed = get(address, 0.3 if talk is drip else 20.0)
    assert failed.status is SourceStatus.FAILED
    assert told in failed.text
    assert "\n" not in failed.text


@pytest.mark.parametrize(
    "address",
    [
        "file:///etc/passwd",
        "https://127.0.0.1/",
        "http://example.org/",
        "http://me@127.0.0.1/",
        "http://127.0.0.1/a b",
        "http://127.0.0.1/a\r\nX: y",
        "http://127.0.0.1:99999/",
        "http://[",
    ],
)
def test_nobody_else_is_asked(address: str) -> None:
    refused = get(address)
    assert refused.status is SourceStatus.FAILED
    assert "\n" not in refused.text
