"""A resolution service over HTTP on loopback."""

from __future__ import annotations

import logging
import threading
from contextlib import ExitStack
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import ClassVar, Final

import click

from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.bench.operator import parse_fault_spec
from tickrig.emulators.tkernel.operated import Operated
from tickrig.emulators.tkernel.resolution import ResolutionService
from tickrig.emulators.tkernel.ucode_table import EXAMPLE, UcodeTable, parse_table
from tickrig.host.cli.control import serving_control, stopped_by_signals
from tickrig.host.cli.messages import Refused, refuse_path, refused_at, say, warnings_shown
from tickrig.host.control.clock import ServingClock

_LOOPBACK: Final = "127.0.0.1"
_POLL_S: Final = 0.02
_IDLE_S: Final = 5.0
"""Silence after which a client is disconnected."""

_LOG: Final = logging.getLogger(__name__)


class HttpService:
    """HTTP server of an emulated ucode resolution service, in its own threads.

    Args:
        service: the service, whose `base` becomes the address of this server.
        port: number of the port on loopback, or 0 to select a free port.

    Attributes:
        url: address of the server.

    Raises:
        OSError: the port is in use.
    """

    def __init__(self, service: ResolutionService, port: int = 0) -> None:
        self._service, self._closing, self._lock = service, threading.Event(), threading.Lock()
        self._server: ThreadingHTTPServer | None = None
        self._port = port
        self._listen()
        service.base = self.url = f"http://{_LOOPBACK}:{self._port}"

    def follow(self) -> None:
        """Stop listening while the fault `unreachable` is active, and listen again after it.

        This method must be called periodically. If another program has taken the port, a message is
        logged and the port is tried again.
        """
        if not self._service.reachable:
            self._hang_up()
        elif self._server is None:
            try:
                self._listen()
            except OSError as error:
                _LOG.warning("port %d cannot be had again: %s", self._port, error)

    def close(self) -> None:
        """Stop the server; late answers are not sent."""
        self._closing.set()
        self._hang_up()

    def _listen(self) -> None:
        service, lock, closing = self._service, self._lock, self._closing

        class Handler(_Handler):
            pass

        Handler.service, Handler.lock, Handler.closing = service, lock, closing
        self._server = server = _Server((_LOOPBACK, self._port), Handler)
        self._port = server.server_address[1]
        threading.Thread(target=server.serve_forever, args=(_POLL_S,), daemon=True).start()

    def _hang_up(self) -> None:
        server, self._server = self._server, None
        if server is not None:
            server.shutdown()
            server.server_close()


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False

    def handle_error(self, request: object, client_address: object) -> None:
        """Ignore clients that disconnect or send invalid data."""


class _Handler(BaseHTTPRequestHandler):
    service: ClassVar[ResolutionService]
    lock: ClassVar[threading.Lock]
    closing: ClassVar[threading.Event]
    timeout = _IDLE_S

    def do_GET(self) -> None:
        """Answer a request, with a delay if the fault `slow` is active."""
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
        """Log a request at the level DEBUG."""
        _LOG.debug(format, *args)


# Run a resolution service for its command line.

_LOOK_US = 20_000
"""Period at which the server checks its faults."""


def _read_table(path: Path) -> UcodeTable:
    """Read the table of a file; raise Refused if the table is invalid."""
    try:
        return parse_table(path.read_text("utf-8"))
    except OSError as error:
        refuse_path("table", error)
    except ValueError as error:
        raise Refused(f"table {path}: {error}") from None


def run_service(
    table: Path | None, *, port: int, control: Path | None, faults: tuple[str, ...], example: bool
) -> None:
    """Serve a table of ucodes over HTTP until a request or Ctrl-C ends the service.

    With `example` only print an example table.

    Raises:
        Refused: the options cannot be carried out.
    """
    if example:
        click.echo(EXAMPLE, nl=False)
        return
    if table is None:
        raise Refused("give a TABLE, or --example for one to begin with")
    service = ResolutionService(_read_table(table), "")
    running = [True]
    operated = Operated("ucode-resolver", service, running.clear)
    with refused_at("--fault"):
        operated.plan(map(parse_fault_spec, faults))
    clock = ServingClock()
    with warnings_shown(), ExitStack() as stack:
        stack.enter_context(stopped_by_signals(running.clear))
        http = _open(service, port)
        stack.callback(http.close)
        if control is not None:
            stack.enter_context(serving_control(control, EmulatorControl(operated), clock))
        click.echo(http.url)
        say(f"{len(service.table.ucodes)} ucodes at {http.url}/ucodes/UCODE. Ctrl-C ends.")
        while running:
            clock.wait_until(clock.now_us + _LOOK_US)
            operated.tick(clock.now_us)
            http.follow()
    say(f"requests: {service.read('requests')}; unknown: {service.read('unknown')}")


def _open(service: ResolutionService, port: int) -> HttpService:
    try:
        return HttpService(service, port)
    except OSError as error:
        raise Refused(f"--port {port}: {error.strerror}") from None
