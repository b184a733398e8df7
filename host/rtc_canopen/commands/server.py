"""The command `rtc-canopen-server`."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, Final, TextIO

import click

from tickrig.host.cli.can_options import BusCommand, BusOptions, bus_options, open_raw
from tickrig.host.cli.duration import parse_time_us
from tickrig.host.cli.options import PATH
from tickrig.host.cli.refused import Refused, refuse_path
from tickrig.host.errors import LinkClosed
from tickrig.host.link import NEVER, Link
from tickrig.wire.can import Frames

if TYPE_CHECKING:
    from tickrig.host.can_link import CanLink
    from tickrig.host.rtc_canopen.definition import BusEntry, SystemDefinition
    from tickrig.host.rtc_canopen.events import Event, Listener
    from tickrig.host.rtc_canopen.server import Server

ECHOING: Final = ("udp_multicast",)
"""Interfaces that give back what they sent, whatever is asked of them."""

ENDING: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
STANDARD_OUTPUT: Final = Path("-")


class BusFailed(click.ClickException):
    """One line on standard error, and exit status 3."""

    exit_code = 3


@click.command(cls=BusCommand)
@click.argument("file", type=PATH)
@bus_options
@click.option("--log", type=PATH, help="File for the events, a line of JSON each (- is stdout).")
@click.option("--for", "span", metavar="TIME", help="End after 90s, 500ms; else at Ctrl-C.")
@click.option("--start", is_flag=True, help="Activate all nodes in the start order.")
@click.option("--check", is_flag=True, help="Read FILE and its EDS files, and end.")
@click.option("-q", "--quiet", is_flag=True, help="Do not tell the events on standard error.")
def main(file: Path, span: str | None, **options: Any) -> None:
    """Manage the CANopen nodes of a System Definition as RT components.

    FILE is YAML or JSON. The bus is that of FILE unless -i and -c name another.
    The server is NMT master and heartbeat consumer: it sets the nodes up, makes
    a proxy of each, links their PDOs and connects their ports, and sees nodes
    come and go. At Ctrl-C it resets their communication.

    \b
    rtc-canopen-server robot.yaml
    rtc-canopen-server robot.yaml -i socketcan -c vcan0 --start --log events.jsonl
    rtc-canopen-server robot.yaml --check
    """  # noqa: D301 - click wants the backspace
    from tickrig.host.rtc_canopen.serve import read_files  # noqa: PLC0415 - canopen is slow
    from tickrig.host.rtc_canopen.server import Server  # noqa: PLC0415

    span_us = _span_us(span)
    definition = _read(file)
    try:
        files = read_files(definition, file.parent)
    except ValueError as error:
        raise Refused(str(error)) from None
    if options.pop("check"):
        click.echo(f"{file}: {len(definition.nodes)} nodes, no mistake found")
        return
    server = Server(definition, files)
    log, quiet, start = (options.pop(name) for name in ("log", "quiet", "start"))
    with ExitStack() as stack:
        server.log.listeners += _listeners(log, stack, quiet=quiet)
        link = _open(_bus(BusOptions(**options), definition.bus), server, stack)
        if start:
            server.start()
        _run(server, link, span_us)


def _run(server: Server, link: Link[Frames], span_us: int) -> None:
    from tickrig.host.rtc_canopen.serve import serve  # noqa: PLC0415

    until_us = NEVER if span_us == NEVER else link.now_us + span_us
    try:
        with _stopped_by_signals() as stopped:
            serve(server, link, until_us, lambda: bool(stopped))
        link.send(server.stop(link.now_us))
    except LinkClosed as error:
        raise BusFailed(str(error)) from None


def _read(file: Path) -> SystemDefinition:
    try:
        from tickrig.host.rtc_canopen.definition_reader import parse_definition  # noqa: PLC0415
    except ModuleNotFoundError as error:
        raise Refused(f"{error}: pip install 'tickrig[rtc]'") from None
    try:
        return parse_definition(file.read_text("utf-8"))
    except UnicodeDecodeError as error:
        raise Refused(f"{file}: byte {error.start} is not UTF-8") from None
    except OSError as error:
        refuse_path("file", error)
    except ValueError as error:
        raise Refused(f"{file}: {error}") from None


def _span_us(span: str | None) -> int:
    try:
        return NEVER if span is None else parse_time_us(span)
    except ValueError as error:
        raise Refused(f"--for: {error}") from None


def _bus(options: BusOptions, entry: BusEntry) -> BusOptions:
    """Return the bus of the command line, that of the file where it names none."""
    if options or entry.channel is None:
        return options
    return replace(
        options,
        interface=entry.interface or "socketcan",
        channel=entry.channel,
        bitrate=options.bitrate or entry.bitrate,
    )


def _open(options: BusOptions, server: Server, stack: ExitStack) -> Link[Frames]:
    from tickrig.host.can_link import CanLink  # noqa: PLC0415
    from tickrig.host.echo_free_link import EchoFreeLink  # noqa: PLC0415

    bus, interface, channel = open_raw(options)
    link = CanLink(bus, f"{interface}:{channel}", drops=True)
    stack.callback(_close, link)
    link.on_error_state = server.bus_state
    click.echo(f"{len(server.nodes)} nodes on {interface} {channel}. Ctrl-C ends.", err=True)
    return EchoFreeLink(link) if interface in ECHOING else link


def _listeners(log: Path | None, stack: ExitStack, *, quiet: bool) -> Iterator[Listener]:
    if not quiet:
        yield lambda event: click.echo(str(event), err=True)
    if log == STANDARD_OUTPUT:
        yield lambda event: click.echo(event.to_json())
    elif log is not None:
        try:
            file = stack.enter_context(log.open("w", encoding="utf-8", buffering=1))
        except OSError as error:
            refuse_path("--log", error)
        yield lambda event: _write(file, event)


def _write(file: TextIO, event: Event) -> None:
    file.write(f"{event.to_json()}\n")


def _close(link: CanLink) -> None:
    if link.lost:
        click.echo(f"{link.lost} frames were lost: the bus took none", err=True)
    link.close()


@contextmanager
def _stopped_by_signals() -> Iterator[list[int]]:
    """Collect the signals that end a program; Ctrl-C, SIGTERM, a closed terminal."""
    received: list[int] = []

    def receive(number: int, frame: FrameType | None) -> None:
        received.append(number)

    before = {number: signal.signal(number, receive) for number in ENDING}
    try:
        yield received
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
