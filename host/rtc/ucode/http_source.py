"""Information about ucodes over HTTP, in a thread of its own."""

from __future__ import annotations

import queue
import socket
import time
from functools import partial
from http.client import HTTPException, HTTPResponse
from io import BytesIO
from typing import Final
from urllib.parse import SplitResult, urlsplit

from tickrig.host.rtc.system.peer_thread import PeerThread
from tickrig.host.rtc.ucode.cache import Fetched, SourceStatus

_TIMEOUT_S: Final = 1.0
MOST_OCTETS: Final = 8_192
"""Maximum number of octets of an answer with its head."""


class HttpSource:
    """HTTP client that does not block, because its own thread sends the GET requests.

    An answer must arrive within `timeout_s`, and may have at most 8192 bytes. The client sends
    requests only to the given hosts. It does not follow redirections, and does not support HTTPS.

    Args:
        name: name of the client, for messages.
        hosts: hosts that may get requests.
        timeout_s: time limit for a whole answer, in seconds.
    """

    def __init__(self, name: str, hosts: tuple[str, ...], timeout_s: float = _TIMEOUT_S) -> None:
        self._hosts, self._timeout_s = hosts, timeout_s
        self._thread = PeerThread(name)
        self._ended: queue.SimpleQueue[Fetched] = queue.SimpleQueue()

    def request(self, address: str, now_us: int) -> None:
        """Request the text at an address."""
        self._thread.submit(partial(self._fetch, address))

    def take(self, now_us: int) -> tuple[Fetched, ...]:
        """Return the requests that have ended."""
        ended = []
        while not self._ended.empty():
            ended.append(self._ended.get_nowait())
        return tuple(ended)

    def close(self) -> None:
        """End the thread after the present request, without waiting for it."""
        self._thread.close()

    def _fetch(self, address: str) -> None:
        try:
            fetched = self._get(address, _parts(address, self._hosts))
        except (OSError, HTTPException, ValueError) as error:
            why = " ".join(f"{address[:80]}: {error}".split())
            fetched = Fetched(address, SourceStatus.FAILED, why[:200])
        self._ended.put(fetched)

    def _get(self, address: str, parts: SplitResult) -> Fetched:
        raw = _exchange(parts, time.monotonic() + self._timeout_s)
        response = HTTPResponse(_Received(raw))  # type: ignore[arg-type] # all it wants is makefile
        response.begin()
        text = response.read().decode()
        match response.status:
            case 200:
                return Fetched(address, SourceStatus.FOUND, text)
            case 404:
                return Fetched(address, SourceStatus.UNKNOWN)
            case other:
                raise ValueError(f"HTTP status {other}")


class _Received:
    """Received data as an object that can replace a socket."""

    def __init__(self, raw: bytes) -> None:
        self._raw = raw

    def makefile(self, mode: str) -> BytesIO:
        """Return the data as a file."""
        return BytesIO(self._raw)


def _parts(address: str, hosts: tuple[str, ...]) -> SplitResult:
    parts = urlsplit(address)
    if parts.scheme != "http" or parts.hostname not in hosts or parts.username is not None:
        raise ValueError(f"{address[:80]!r} is not http:// at one of {', '.join(hosts)}")
    if not address.isascii() or not address.isprintable() or " " in address:
        raise ValueError(f"{address[:80]!r} is no address")
    return parts


def _exchange(parts: SplitResult, deadline_s: float) -> bytes:
    """Send a request. Return all data until the other end closes the connection."""
    request = f"GET {parts.path or '/'} HTTP/1.0\r\nHost: {parts.netloc}\r\n\r\n"
    end = (str(parts.hostname), parts.port or 80)
    with socket.create_connection(end, _left_s(deadline_s)) as connection:
        connection.sendall(request.encode())
        raw = b""
        while True:
            connection.settimeout(_left_s(deadline_s))
            if not (part := connection.recv(MOST_OCTETS + 1)):
                return raw
            raw += part
            if len(raw) > MOST_OCTETS:
                raise ValueError(f"the answer has more than {MOST_OCTETS} octets")


def _left_s(deadline_s: float) -> float:
    if (left_s := deadline_s - time.monotonic()) <= 0:
        raise TimeoutError("timed out")
    return left_s
