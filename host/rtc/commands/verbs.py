"""The verbs of `tickrig rtc` about components and their ports."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import click

from tickrig.host.cli.control import refused_by
from tickrig.host.cli.options import NumberRange
from tickrig.host.cli.refused import Refused, time_us
from tickrig.host.control.client import ControlClient
from tickrig.host.rtc.commands.request import (
    SYSTEM,
    at,
    complete_component,
    complete_port,
    complete_type,
    components,
    request_system,
    settle,
)
from tickrig.host.rtc.commands.texts import component_lines, component_row, port_line, value_line
from tickrig.host.text.page_text import json_text

DATAPORT: Final = "dataport."
POLL_S: Final = 0.02

as_json = click.option("--json", "as_json", is_flag=True, help="Print the answer as JSON.")
some_names = click.argument("names", nargs=-1, shell_complete=complete_component)
names_needed = click.argument("names", nargs=-1, required=True, shell_complete=complete_component)


@click.command()
@some_names
@click.option("-l", "--long", is_flag=True, help="Show state, ports, rate and type, too.")
@click.option("-R", "--recursive", is_flag=True, help="Show the ports of each component, too.")
@as_json
@at
def ls(at: Path, names: tuple[str, ...], long: bool, recursive: bool, as_json: bool) -> None:
    """List the components NAMES, all if none is named.

    With -l a line is: state, ports/those connected, rate, type, name.
    """
    described = components(at, *names)
    if as_json:
        click.echo(json_text(described))
        return
    for component in described:
        click.echo(component_row(component) if long else component["name"])
        for port in component["ports"] if recursive else ():
            click.echo(port_line(port))


@click.command()
@names_needed
@click.option("-l", "--long", is_flag=True, help="Show properties of connectors, and all sets.")
@as_json
@at
def cat(at: Path, names: tuple[str, ...], long: bool, as_json: bool) -> None:
    """Show the components NAMES: type, state, ports, connectors, configuration."""
    described = components(at, *names)
    if as_json:
        click.echo(json_text(described))
        return
    for component in described:
        for line in component_lines(component, long=long):
            click.echo(line)


@click.command()
@click.argument("type_name", metavar="TYPE", shell_complete=complete_type)
@click.argument("name", default="")
@click.option("--rate", "rate_hz", type=NumberRange(1e-6, 1e6), help="In Hz.  [1000]")
@at
def create(at: Path, type_name: str, name: str, rate_hz: float | None) -> None:
    """Create a component of TYPE, and print its name, such as ConsoleIn0."""
    rate = {} if rate_hz is None else {"rate_hz": rate_hz}
    click.echo(request_system(at, "create", type=type_name, name=name, **rate)["name"])


@click.command()
@click.argument("first", shell_complete=complete_port)
@click.argument("second", shell_complete=complete_port)
@click.option("-p", "--property", "properties", multiple=True, metavar="KEY=VALUE")
@click.option("-n", "--name", default="", help="Name of the connector.")
@at
def con(at: Path, first: str, second: str, properties: tuple[str, ...], name: str) -> None:
    """Connect the ports FIRST and SECOND.

    Keys of properties stand with or without `dataport.` before them.

    \b
    tickrig rtc con ConsoleIn0.out ConsoleOut0.in
    tickrig rtc con A0.out B0.in -p subscription_type=new -p buffer.length=64
    """  # noqa: D301 - click wants the backspace
    given = dict(_property(word) for word in properties)
    request_system(at, "connect", ports=[first, second], properties=given, name=name)


@click.command()
@click.argument("ports", nargs=-1, required=True, shell_complete=complete_port)
@at
def dis(at: Path, ports: tuple[str, ...]) -> None:
    """End the connector between two PORTS, all of one port, or all of a component."""
    request_system(at, "disconnect", ports=list(ports))


@click.command("exit")
@names_needed
@at
def exit_(at: Path, names: tuple[str, ...]) -> None:
    """End the components NAMES, and their connectors."""
    for name in names:
        request_system(at, "delete", name=name)


@click.command(context_settings={"ignore_unknown_options": True})
@click.argument("port", shell_complete=complete_port)
@click.argument("value")
@at
def inject(at: Path, port: str, value: str) -> None:
    """Write VALUE to the InPort PORT, as an OutPort connected with it would.

    VALUE is JSON, and nothing else: the data of a value with a time, or a whole
    struct. Octets are lists of numbers, enumerators names.

    \b
    tickrig rtc inject ConsoleOut0.in -5
    tickrig rtc inject SeqIn0.DoubleSeq '[1, 2.5]'
    tickrig rtc inject Map0.at '{"x": 1, "y": 2}'
    tickrig rtc inject ConsoleOut0.in '{"tm": {"sec": 1, "nsec": 0}, "data": 7}'
    """  # noqa: D301 - click wants the backspace
    try:
        given = json.loads(value)
    except (ValueError, RecursionError):
        raise Refused(f"{value!r:.60} is not JSON, as 5, [1, 2], true or '\"text\"'") from None
    request_system(at, "inject", port=port, value=given)


@click.command("print")
@click.argument("port", shell_complete=complete_port)
@click.option("-n", "count", type=click.IntRange(1), help="End after so many values.")
@click.option("--for", "duration", metavar="TIME", help="End after this time, as 2s.")
@click.option("--json", "as_json", is_flag=True, help="Print each value as a JSON object.")
@at
def print_(at: Path, port: str, count: int | None, duration: str | None, as_json: bool) -> None:
    """Print what the OutPort PORT writes from now on, a line a value; Ctrl-C ends.

    A line is the value's time in seconds and its data as JSON.

    \b
    tickrig rtc print ConsoleIn0.out
    tickrig rtc print SeqOut0.Long -n 10 --json
    """  # noqa: D301 - click wants the backspace
    until_s = time.monotonic() + time_us("--for", duration) / 1e6 if duration else None
    try:
        for value in _values(at, port, count, until_s):
            click.echo(json_text(value) if as_json else value_line(value))
    except KeyboardInterrupt:
        return


def _moving(name: str, verb: str, wanted: str, text: str) -> click.Command:
    """Return a command that asks components for a state, and waits until they are there."""

    @click.command(name, help=f"{text}, and wait until they are {wanted.capitalize()}.")
    @names_needed
    @click.option("--wait", default="2s", help="How long to wait for it; 0 asks only.  [2s]")
    @at
    def move(at: Path, names: tuple[str, ...], wait: str) -> None:
        wait_us = time_us("--wait", wait)
        for component in names:
            request_system(at, verb, name=component)
        for component in names:
            settle(at, component, wanted, wait_us)

    return move


MOVES: Final = (
    _moving("act", "activate", "ACTIVE", "Activate the components NAMES"),
    _moving("deact", "deactivate", "INACTIVE", "Deactivate the components NAMES"),
    _moving("reset", "reset", "INACTIVE", "Reset the components NAMES from Error"),
)


def _property(word: str) -> tuple[str, str]:
    key, equals, value = word.partition("=")
    if not key or not equals:
        raise Refused(f"-p {word!r} is not KEY=VALUE")
    return (key if key.startswith(DATAPORT) else DATAPORT + key), value


def _values(socket: Path, port: str, count: int | None, until_s: float | None) -> Iterator[Any]:
    """Yield values until there were enough of them, or it is time."""
    with refused_by(socket, SYSTEM), ControlClient(socket) as client:
        latest = client.request("seen", port=port)["latest"]
        given = 0
        while until_s is None or time.monotonic() < until_s:
            answer: Any = client.request("seen", port=port, since=latest)
            _report_lost(answer, latest)
            latest = answer["latest"]
            for seen in answer["values"]:
                yield seen["value"]
                given += 1
                if given == count:
                    return
            time.sleep(POLL_S)


def _report_lost(answer: Any, latest: Any) -> None:
    if lost := answer["latest"] - latest - len(answer["values"]):
        click.echo(f"{lost} values lost: they came faster than they were taken", err=True)


VERBS: Final = (ls, cat, create, con, dis, *MOVES, exit_, inject, print_)
