"""A resolution service over HTTP on loopback."""

from __future__ import annotations

import logging
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import ClassVar, Final

from tickrig.emulators.tkernel.resolution.service import ResolutionService

LOOPBACK: Final = "127.0.0.1"
POLL_S: Final = 0.02
IDLE_S: Final = 5.0
"""A client that says nothing for so long is hung up on."""

_LOG: Final = logging.getLogger(__name__)


class HttpService:
    """Serves a service in threads of its own, as long as it is reachable.

    Args:
        service: answers; its `base` becomes the address of this server.
        port: of loopback; 0 takes a free one.

    Attributes:
        url: where it is.

    Raises:
        OSError: the port is taken.
    """

    def __init__(self, service: ResolutionService, port: int = 0) -> None:
        self._service, self._closing, self._lock = service, threading.Event(), threading.Lock()
        self._server: ThreadingHTTPServer | None = None
        self._port = port
        self._listen()
        service.base = self.url = f"http://{LOOPBACK}:{self._port}"

    def follow(self) -> None:
        """Listen, or not, as the fault `unreachable` has it; to be called now and then.

        A port that somebody else took meanwhile is told, and tried again.
        """
        if not self._service.reachable:
            self._hang_up()
        elif self._server is None:
            try:
                self._listen()
            except OSError as error:
                _LOG.warning("port %d cannot be had again: %s", self._port, error)

    def close(self) -> None:
        """End; answers that are late are not given."""
        self._closing.set()
        self._hang_up()

    def _listen(self) -> None:
        service, lock, closing = self._service, self._lock, self._closing

        class Handler(_Handler):
            pass

        Handler.service, Handler.lock, Handler.closing = service, lock, closing
        self._server = server = _Server((LOOPBACK, self._port), Handler)
        self._port = server.server_address[1]
        threading.Thread(target=server.serve_forever, args=(POLL_S,), daemon=True).start()

    def _hang_up(self) -> None:
        server, self._server = self._server, None
        if server is not None:
            server.shutdown()
            server.server_close()


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False

    def handle_error(self, request: object, client_address: object) -> None:
        """Say nothing of clients that hang up or talk nonsense."""


class _Handler(BaseHTTPRequestHandler):
    service: ClassVar[ResolutionService]
    lock: ClassVar[threading.Lock]
    closing: ClassVar[threading.Event]
    timeout = IDLE_S

    def do_GET(self) -> None:
        """Answer, later if it is slow."""
        with self.lock:
            response = self.service.respond(self.path)
        if self.closing.wait(response.delay_us / 1e6):
            return
        body = response.text.encode()
        self.send_response(response.status)
        self.send_header("Content-Type", "text/plain; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 - as http.server has it
        """Log a request where somebody wants to see it."""
        _LOG.debug(format, *args)
