"""The command `rtc-canopen-server`."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig.host.cli.can_options import BusCommand, BusOptions, bus_options
from tickrig.host.cli.control import serving_control, stopped_by_signals
from tickrig.host.cli.engine_options import (
    EngineOptions,
    openrtm_options,
    ros2_options,
    take_engines,
)
from tickrig.host.cli.messages import BusFailed, Refused, warnings_shown
from tickrig.host.cli.options import PATH, version_option
from tickrig.host.links.link import LinkClosed, StampedLink
from tickrig.host.rtc.canopen.commands.opening import (
    bus_of,
    component_option,
    log_listener,
    open_link,
    read_server,
)
from tickrig.host.text.values import parse_time_us
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.host.rtc.canopen.serve import ServerRunner
    from tickrig.host.rtc.canopen.server import RtcCanopenServer
    from tickrig.host.rtc.system.call_queue import CallQueue

_QUICK_US: Final = 2_000
"""So long at most a call of an engine waits for the bus."""


@click.command(cls=BusCommand)
@click.argument("file", type=PATH)
@bus_options
@component_option
@click.option("--log", type=PATH, help="File for the events, a line of JSON each (- is stdout).")
@click.option("--for", "span", metavar="TIME", help="End after 90s, 500ms; else at Ctrl-C.")
@click.option("--control", type=PATH, help="Control socket to serve, for 'tickrig ctl'.")
@click.option("--start", is_flag=True, help="Activate all nodes in the start order.")
@click.option("--check", is_flag=True, help="Read FILE and its EDS files, and end.")
@click.option("--dot", is_flag=True, help="Draw FILE as a graph for Graphviz, and end.")
@click.option("-q", "--quiet", is_flag=True, help="Do not tell the events on standard error.")
@openrtm_options
@ros2_options
@version_option()
def main(file: Path, span: str | None, **options: Any) -> None:
    """Manage the CANopen nodes of a System Definition as RT components.

    FILE is YAML or JSON. The bus is that of FILE unless -i and -c name another.
    The server is NMT master and heartbeat consumer: it sets the nodes up, makes
    a proxy of each, links their PDOs and connects their ports, and sees nodes
    come and go. At Ctrl-C it resets their communication.

    \b
    rtc-canopen-server robot.yaml
    rtc-canopen-server robot.yaml -i socketcan -c vcan0 --start --log events.jsonl
    rtc-canopen-server robot.yaml --control /tmp/robot.ctl
    rtc-canopen-server robot.yaml --component Logger0=parts.py:Logger
    rtc-canopen-server robot.yaml --openrtm localhost:2809
    rtc-canopen-server robot.yaml --ros2
    rtc-canopen-server robot.yaml --check
    rtc-canopen-server robot.yaml --dot | dot -Tsvg -o robot.svg
    """  # noqa: D301 - click wants the backspace
    span_us, engines = _span_us(span), take_engines(options)
    server = read_server(file, options.pop("components"))
    definition = server.definition
    if options.pop("check"):
        _check(file, server)
        return
    if options.pop("dot"):
        from tickrig.host.rtc.canopen.offline import draw_graph  # noqa: PLC0415

        click.echo(draw_graph(server))
        return
    names = "log", "quiet", "start", "control"
    log, quiet, start, control = (options.pop(name) for name in names)
    with warnings_shown(), ExitStack() as stack:
        if not quiet:
            server.log.listeners.append(lambda event: click.echo(str(event), err=True))
        server.log.listeners += log_listener(log, stack)
        bus = bus_of(BusOptions(**options), definition.bus)
        link, name = open_link(bus, server.bus_state, stack)
        if start:
            server.start()
        _run(server, link, span_us, _Doors(control, name, engines))


def _check(file: Path, server: RtcCanopenServer) -> None:
    from tickrig.host.rtc.canopen.offline import check_offline  # noqa: PLC0415

    if mistakes := check_offline(server):
        raise Refused("\n".join(f"{file}: {mistake}" for mistake in mistakes))
    click.echo(f"{file}: {len(server.nodes)} nodes, no mistake found")


def _run(server: RtcCanopenServer, link: StampedLink, span_us: int, doors: _Doors) -> None:
    from tickrig.host.rtc.canopen.serve import ServerRunner  # noqa: PLC0415

    until_us = NEVER if span_us == NEVER else link.now_us + span_us
    runner = ServerRunner(server, link)
    try:
        with ExitStack() as stack:
            stack.enter_context(stopped_by_signals(runner.stop))
            click.echo(f"{len(server.nodes)} nodes on {doors.bus}. Ctrl-C ends.", err=True)
            doors.open(stack, server, runner)
            runner.run(until_us)
        link.send(server.stop(link.now_us))
    except LinkClosed as error:
        raise BusFailed(str(error)) from None


@dataclass(frozen=True, slots=True)
class _Doors:
    """By which others work with a server while it runs: a control socket, engines."""

    control: Path | None
    bus: str
    engines: EngineOptions

    def open(self, stack: ExitStack, server: RtcCanopenServer, runner: ServerRunner) -> None:
        if self.control is not None:
            from tickrig.host.rtc.canopen.commands.server_control import (  # noqa: PLC0415
                ServerControl,
            )

            requests = ServerControl(server, runner, self.bus)
            door = stack.enter_context(serving_control(self.control, requests, runner))
        if not self.engines:
            return
        from tickrig.host.rtc.engines.engines_joined import engines_joined  # noqa: PLC0415

        def attach(calls: CallQueue) -> None:
            runner.pause_us = _QUICK_US
            if self.control is None:
                runner.serve = calls.serve
            else:
                door.attach(calls, calls.make)

        stack.enter_context(
            engines_joined(self.engines, server.manager, attach, runner.stop, fixed=True)
        )


def _span_us(span: str | None) -> int:
    try:
        return NEVER if span is None else parse_time_us(span)
    except ValueError as error:
        raise Refused(f"--for: {error}") from None
