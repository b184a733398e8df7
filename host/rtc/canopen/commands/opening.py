"""The common work of the server commands: reading files, opening the bus, running the server."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import click

from tickrig.host.cli.can_options import BusOptions, open_raw
from tickrig.host.cli.control import serving_control, stopped_by_signals
from tickrig.host.cli.engine_options import EngineOptions
from tickrig.host.cli.messages import (
    Refused,
    SourceFailed,
    refuse_path,
    show_findings,
    warnings_shown,
)
from tickrig.host.control.requests import Object, whole
from tickrig.host.links.can_link import CanLink
from tickrig.host.links.echo import free_of_echo
from tickrig.host.links.link import LinkClosed, StampedLink
from tickrig.host.rtc.canopen.definition import BusEntry
from tickrig.host.rtc.canopen.events import EventListener
from tickrig.host.rtc.canopen.offline import check_offline, draw_graph
from tickrig.host.rtc.canopen.serve import ServerRunner, open_server
from tickrig.host.rtc.canopen.server import RtcCanopenServer
from tickrig.host.rtc.canopen.view import NOT_HEARD, NodeView, ServerView
from tickrig.host.rtc.commands.system_control import SystemControl
from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.engines.engines_joined import engines_joined
from tickrig.host.rtc.system.call_queue import CallQueue
from tickrig.host.text.user_file import explain_error, find_class
from tickrig.wire.can import ErrorState
from tickrig.wire.instant import NEVER

# The control socket of a server.

_NOT_HERE: Final = ("create", "delete", "save")
"""Requests of a system that the server decides itself, because its nodes come and go on the bus."""


class ServerControl(SystemControl):
    """Answers the requests to the control socket of a CANopen server and its nodes.

    Args:
        server: server to control. Its method `tick` must not run during a request.
        runner: runner of the server.
        bus: name of the bus.
    """

    def __init__(self, server: RtcCanopenServer, runner: ServerRunner, bus: str) -> None:
        super().__init__(server.manager, runner)
        self._server, self._bus = server, bus
        self._verbs = {
            **{name: verb for name, verb in self._verbs.items() if name not in _NOT_HERE},
            "restart": (self._restart, ("node",)),
            "start": (self._start, ()),
        }

    def _status(self, request: Object) -> Object:
        nodes = [_describe_node(node) for node in ServerView(self._server).nodes]
        return {"link": self._bus, **super()._status(request), "nodes": nodes}

    def _restart(self, request: Object) -> Object:
        ServerView(self._server).restart(whole(request.get("node"), "node", 1, 127))
        return {}

    def _start(self, request: Object) -> Object:
        self._server.start()
        return {}


def _describe_node(node: NodeView) -> Object:
    age_us = node.heartbeat_age_us
    return {
        "node": node.node_id,
        "name": node.name,
        "phase": node.phase.value,
        "nmt_state": node.nmt_state,
        "proxy_state": node.proxy_state,
        "heartbeat_age_us": None if age_us == NOT_HEARD else age_us,
        "problem": node.problem,
    }


# Files, the bus, and the run.

STANDARD_OUTPUT: Final = Path("-")


def read_server(file: Path, components: Sequence[str]) -> RtcCanopenServer:
    """Create the server for a System Definition, with the additional components of the user.

    Raise Refused if the definition or a component cannot be used. Mistakes in EDS files that do not
    prevent their use are printed to standard error.

    Args:
        file: path of the System Definition.
        components: components in the form `Logger0=parts.py:Logger`.
    """
    try:
        server = open_server(file)
        add_components(server, components)
    except OSError as error:
        refuse_path("file", error)
    except ValueError as error:
        raise Refused(str(error)) from None
    show_findings(server.findings)
    return server


def add_components(server: RtcCanopenServer, words: Sequence[str]) -> None:
    """Add components that are defined in Python files of the user to a server.

    Args:
        server: server that gets the components. The components run at the rate of the server's
            proxies.
        words: components in the form `Logger0=parts.py:Logger`.

    Raises:
        ValueError: a component cannot be added.
    """
    for word in words:
        name, equals, spec = word.partition("=")
        if not (name and equals):
            raise ValueError(f"--component {word!r} is not NAME=FILE.py:Class")
        file = spec.rpartition(":")[0]
        try:
            component = find_class(spec, RtComponent)(name)
            server.manager.add(component, server.definition.master.rate_hz)
            server.manager.activate(name)
        except Exception as error:  # a user's file may raise anything
            raise ValueError(f"--component {name}: {explain_error(error, file)}") from error


def open_link(
    options: BusOptions, bus_state: Callable[[ErrorState], None], stack: ExitStack
) -> tuple[StampedLink, str]:
    """Open the CAN bus for a server. Return the link to the bus, and the name of the bus.

    Args:
        options: options that select the bus.
        bus_state: function that is called with each state report of the CAN controller.
        stack: exit stack that closes the bus.
    """
    bus, interface, channel = open_raw(options)
    link = CanLink(bus, f"{interface}:{channel}", drops=True)
    stack.callback(_close, link)
    link.on_error_state = bus_state
    name = f"{interface} {channel}"
    return free_of_echo(link, interface), name


def bus_of(options: BusOptions, entry: BusEntry) -> BusOptions:
    """Return the bus that the command line selects, or else the bus of the System Definition."""
    if options or entry.channel is None:
        return options
    return replace(
        options,
        interface=entry.interface or "socketcan",
        channel=entry.channel,
        bitrate=options.bitrate or entry.bitrate,
    )


def log_listener(log: Path | None, stack: ExitStack) -> Iterator[EventListener]:
    """Yield the listener for the option `--log`. Without this option, yield nothing.

    The listener is a function that writes an event of the server to the log file.

    Args:
        log: path of the log file, or None if the option is not given.
        stack: exit stack that closes the file.
    """
    if log == STANDARD_OUTPUT:
        yield lambda event: click.echo(event.to_json())
    elif log is not None:
        try:
            file = stack.enter_context(log.open("w", encoding="utf-8", buffering=1))
        except OSError as error:
            refuse_path("--log", error)
        yield lambda event: click.echo(event.to_json(), file=file)


def _close(link: CanLink) -> None:
    if link.lost:
        click.echo(f"{link.lost} frames were lost: the bus took none", err=True)
    if link.reads.faults:
        click.echo(f"the driver could not read {link.reads.faults} frames", err=True)
    link.close()


# The work of rtc-canopen-server after its options are read.

_QUICK_US: Final = 2_000
"""Longest time that a call of an engine waits for the bus."""


def run_server(file: Path, span_us: int, engines: EngineOptions, options: dict[str, Any]) -> None:
    """Run a server for a System Definition, or only check or draw the definition.

    Args:
        file: path of the System Definition.
        span_us: duration of the run in us, or `NEVER` for no end.
        engines: engines, such as OpenRTM, that connect the system with other systems.
        options: other options of the command line.
    """
    server = read_server(file, options.pop("components"))
    definition = server.definition
    if options.pop("check"):
        _check(file, server)
        return
    if options.pop("dot"):
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
    if mistakes := check_offline(server):
        raise Refused("\n".join(f"{file}: {mistake}" for mistake in mistakes))
    click.echo(f"{file}: {len(server.nodes)} nodes, no mistake found")


def _run(server: RtcCanopenServer, link: StampedLink, span_us: int, doors: _Doors) -> None:
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
        raise SourceFailed(str(error)) from None


@dataclass(frozen=True, slots=True)
class _Doors:
    """Connections of other programs to a running server: a control socket, and engines."""

    control: Path | None
    bus: str
    engines: EngineOptions

    def open(self, stack: ExitStack, server: RtcCanopenServer, runner: ServerRunner) -> None:
        if self.control is not None:
            requests = ServerControl(server, runner, self.bus)
            door = stack.enter_context(serving_control(self.control, requests, runner))
        if not self.engines:
            return

        def attach(calls: CallQueue) -> None:
            runner.pause_us = _QUICK_US
            if self.control is None:
                runner.serve = calls.serve
            else:
                door.attach(calls, calls.make)

        stack.enter_context(
            engines_joined(self.engines, server.manager, attach, runner.stop, fixed=True)
        )
