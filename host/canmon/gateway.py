"""The verb `gateway`, which serves a CANopen network to programs in lines of text (CiA 309-3)."""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

import click

from tickrig.host.canmon.conform.conform_source import open_conform_source
from tickrig.host.canopen.commissioning.node_bus import NodeBus
from tickrig.host.canopen.gateway import Gateway
from tickrig.host.cli.can_options import BusOptions, bus_options
from tickrig.host.cli.control import stopped_by_signals
from tickrig.host.cli.messages import Refused, SourceFailed, refusing, say
from tickrig.host.cli.options import PATH, VERSION
from tickrig.host.control.server import Answer, LineServer
from tickrig.host.control.unix_socket import listen_at
from tickrig.host.links.link import LinkClosed
from tickrig.host.text.values import parse_port

_LOOPBACK: Final = "127.0.0.1"
_WAIT_US: Final = 20_000
"""Time to wait for clients before the bus is read again."""
_MAX_LINE: Final = 16 << 20
_MOST_NET: Final = 0xFFFF
_ERROR: Final = "] ERROR:"


@click.command()
@click.argument("source", required=False)
@click.option(
    "--listen", metavar="[HOST:]PORT", help="Serve a TCP port. The default HOST is 127.0.0.1."
)
@click.option(
    "--socket", "path", type=PATH, help="Serve a Unix socket that only this user can open."
)
@click.option("--net", type=click.IntRange(1, _MOST_NET), default=1, help="Number of the net.  [1]")
@bus_options
def command(
    *, source: str | None, listen: str | None, path: Path | None, net: int, **options: Any
) -> None:
    """Serve SOURCE to other programs in lines of text: CiA 309-3, ASCII mapping.

    Commands come from standard input, or from clients of --listen or --socket, such as
    CANopenNode's cocomm. Each line has one answer. SOURCE is a bus, or a rig file in virtual time.
    Every client that can connect can command all nodes.

    \b
    canmon gateway can0 --listen 60000
    canmon gateway can0 --socket /tmp/CO_command_socket    then: cocomm "5 r 0x1000 0 x32"
    echo "[1] 5 read 0x1017 0 u16" | canmon gateway can0
    echo "[1] help" | canmon gateway can0                  all commands

    \b
    Exit status  0 all is done              2 usage
                 1 a command from standard  3 the bus failed, or nothing can
                   input was not executed     be served at the address
    """  # noqa: D301 - click wants the backspace
    if listen is not None and path is not None:
        raise Refused("--listen and --socket: give one of them")
    address = None if listen is None else parse_address(listen)
    opened = open_conform_source(source, None, BusOptions(**options))
    bus = NodeBus(opened.link, timeout_us=1)
    try:
        if address is None and path is None:
            _answer_input(Gateway(bus, net, VERSION))
        else:
            with _listening(address, path) as (listener, where):
                _serve(
                    listener, bus, net, f"CANopen gateway to {opened.name}, net {net}, at {where}"
                )
    except LinkClosed as error:
        raise SourceFailed(str(error)) from None
    finally:
        opened.close()


def parse_address(text: str) -> tuple[str, int]:
    """Read HOST:PORT or PORT. Raise Refused if the text is neither."""
    host, colon, port = text.rpartition(":")
    number = parse_port(port)
    if number is None or (colon and not host):
        raise Refused(f"--listen {text!r}: a port 0..65535 is wanted, or HOST:PORT")
    return host.removeprefix("[").removesuffix("]") or _LOOPBACK, number


def _answer_input(gateway: Gateway) -> None:
    """Answer standard input. Return exit status 1 if a command was not carried out."""
    failed, shown = False, sys.stdout.isatty()
    for line in sys.stdin.buffer:
        answer = gateway.answer(line.decode("latin-1").rstrip("\r\n"))
        if answer:
            failed |= _ERROR in answer
            # a program reads the bytes of the node; at a terminal nothing obeys them
            click.echo(answer if shown else answer.encode("latin-1", "replace"))
    if failed:
        raise click.exceptions.Exit(1)


@contextmanager
def _listening(
    address: tuple[str, int] | None, path: Path | None
) -> Iterator[tuple[socket.socket, str]]:
    """Listen for clients. Yield the socket, and its address as text for the user."""
    if path is not None:
        with refusing("socket"):
            listener = listen_at(path)
        try:
            yield listener, str(path)
        finally:
            path.unlink(missing_ok=True)
        return
    assert address is not None
    try:
        family = socket.AF_INET6 if ":" in address[0] else socket.AF_INET
        listener = socket.create_server(address, family=family)
    except OSError as error:
        told = f"--listen {address[0]}:{address[1]}"
        if isinstance(error, socket.gaierror):
            raise Refused(f"{told}: {error.strerror}") from None
        reason = os.strerror(error.errno) if error.errno else error
        raise SourceFailed(f"{told}: {reason}") from None
    listener.setblocking(False)
    with listener:
        host, port = listener.getsockname()[:2]
        yield listener, f"{host}:{port}"


def _serve(listener: socket.socket, bus: NodeBus, net: int, greeting: str) -> None:
    """Answer clients until Ctrl-C. Read the bus in between, so that no queue overflows."""
    stopped: list[bool] = []

    def begin() -> Answer:
        gateway = Gateway(bus, net, VERSION)
        return lambda line: _line(gateway.answer(line.decode("latin-1").rstrip("\r")))

    server = LineServer(listener, begin, _refusal, _MAX_LINE)
    with stopped_by_signals(lambda: stopped.append(True)), suppress(KeyboardInterrupt):
        say(f"{greeting}. Ctrl-C ends.")
        while not stopped:
            server.serve(_WAIT_US)
            bus.listen(bus.now_us)
    server.close()


def _line(text: str) -> bytes:
    return f"{text}\r\n".encode("latin-1", "replace")


def _refusal(text: str) -> bytes:
    return _line(f"[0] ERROR:102 #{text}")
