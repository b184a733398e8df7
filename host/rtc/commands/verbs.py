"""The verbs of `tickrig rtc` about components and their ports."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import click

from tickrig.host.cli.control import refused_by
from tickrig.host.cli.messages import Refused, time_us
from tickrig.host.cli.options import PATH, NumberRange
from tickrig.host.cli.start import load
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
from tickrig.host.text.page_text import json_text
from tickrig.host.text.values import format_time

# Descriptions of components as text.


def _component_row(component: Any) -> str:
    """Return a line of `ls -l` with state, connected ports, rate, type and name."""
    ports = component["ports"]
    connected = sum(1 for port in ports if port["connectors"])
    rate = "".join(f"{context['rate_hz']:g}Hz" for context in component["contexts"][:1])
    state = component["state"].capitalize()
    return (
        f"{state:<9} {len(ports):>3}/{connected:<3} {rate:>9}  "
        f"{component['type']:<16} {component['name']}"
    )


def component_lines(component: Any, *, long: bool) -> Iterator[str]:
    """Return the lines with which the command `tickrig rtc cat` describes a component.

    Args:
        component: description of the component, as the control socket returns it.
        long: whether the lines also contain the properties of the connectors and all configuration
            sets.
    """
    yield f"{component['name']}  {component['state'].capitalize()}"
    yield f"  {'Path':<14}{component['path']}"
    for key in ("type", "description", "version", "vendor", "category"):
        yield f"  {key.capitalize():<14}{component[key]}".rstrip()
    for name, text in component["properties"].items():
        yield f"  {'Property':<14}{name} = {text}"
    for context in component["contexts"]:
        runs = "" if context["running"] else ", stopped"
        yield f"  {'Runs at':<14}{context['rate_hz']:g} Hz{runs}"
    for port in component["ports"]:
        yield from _port_lines(port, long=long)
    yield from _configuration_lines(component["configuration"], long=long)


def _port_line(port: Any) -> str:
    """Return the kind, name and data type of a port as text."""
    return f"  {port['kind']:<14}{port['name']}  {_short_type(port['data_type'])}".rstrip()


def _port_lines(port: Any, *, long: bool) -> Iterator[str]:
    yield _port_line(port)
    for interface in port["interfaces"]:
        yield f"    {interface['polarity'].lower()} {interface['name']} ({interface['type']})"
    for connector in port["connectors"]:
        others = [name for name in connector["ports"] if name != port["name"]]
        lost = " (lost)" if connector.get("state") == "lost" else ""
        yield f"    connected to {(others or connector['ports'])[0]}{lost}"
        if long:
            properties = {"name": connector["name"], **connector["properties"]}
            yield from (f"      {key} = {value}" for key, value in properties.items())


def _configuration_lines(configuration: Any, *, long: bool) -> Iterator[str]:
    """Return the parameters with their present values.

    With `long`, also return those of each set.
    """
    for parameter in configuration["parameters"]:
        value = f"{parameter['name']} = {parameter['value']} {parameter['unit']}".rstrip()
        allowed = f"  [{parameter['constraint']}]" if parameter["constraint"] else ""
        yield f"  {'Parameter':<14}{value}{allowed}"
    if not configuration["parameters"]:
        return
    for set_id, values in configuration["sets"].items():
        star = " *" if set_id == configuration["active"] else ""
        yield f"  {'Set':<14}{set_id}{star}"
        if long:
            yield from (f"    {name} = {value}" for name, value in values.items())


def _value_line(value: Any) -> str:
    """Return a value of a port as text, with its time in seconds, if it has a time, and its data.

    >>> _value_line({"tm": {"sec": 1, "nsec": 500000000}, "data": -5})
    '1.500000 -5'
    >>> _value_line({"x": 1.0})
    '{"x": 1.0}'
    """
    if set(value) == {"tm", "data"}:
        time_us = value["tm"]["sec"] * 1_000_000 + value["tm"]["nsec"] // 1_000
        return f"{format_time(time_us)} {json_text(value['data'])}"
    return json_text(value)


def _short_type(idl_id: str) -> str:
    """Return `IDL:RTC/TimedLong:1.0` as `TimedLong`."""
    return idl_id.removeprefix("IDL:").removesuffix(":1.0").removeprefix("RTC/")


# `tickrig rtc conf`: the configuration sets of a component.

_component_name = click.argument("name", shell_complete=complete_component)


@click.group()
def conf() -> None:
    """Show and change the configuration sets of a component.

    A change takes effect before the component's next period.

    \b
    tickrig rtc conf list ConfigSample0
    tickrig rtc conf get ConfigSample0 int_param0
    tickrig rtc conf set ConfigSample0 int_param0 5
    tickrig rtc conf act ConfigSample0 fast
    """  # noqa: D301 - click wants the backspace


@conf.command("list")
@_component_name
@click.option("-l", "--long", is_flag=True, help="Show the values of each set.")
@at
def _list(at: Path, name: str, long: bool) -> None:
    """List the parameters of the component NAME with their present values, and its sets.

    \b
    tickrig rtc conf list ConfigSample0 -l
    """  # noqa: D301 - click wants the backspace
    for line in _configuration_lines(_configuration(at, name), long=long):
        click.echo(line.removeprefix("  "))


@conf.command()
@_component_name
@click.argument("parameter")
@at
def get(at: Path, name: str, parameter: str) -> None:
    """Print the present value of PARAMETER.

    \b
    tickrig rtc conf get ConfigSample0 int_param0
    """  # noqa: D301 - click wants the backspace
    values = {one["name"]: one["value"] for one in _configuration(at, name)["parameters"]}
    if parameter not in values:
        raise Refused(f"no parameter {parameter!r}; known: {', '.join(values) or 'none'}")
    click.echo(values[parameter])


@conf.command("set", context_settings={"ignore_unknown_options": True})
@_component_name
@click.argument("parameter")
@click.argument("value")
@click.option("--set", "set_id", default="", help="Set to change.  [the active set]")
@at
def set_(at: Path, name: str, parameter: str, value: str, set_id: str) -> None:
    """Change PARAMETER to VALUE. Separate the elements of a list by commas.

    \b
    tickrig rtc conf set ConfigSample0 int_param0 5
    """  # noqa: D301 - click wants the backspace
    request_system(at, "set_parameter", name=name, parameter=parameter, value=value, set=set_id)


@conf.command()
@_component_name
@click.argument("set_id", metavar="SET")
@at
def act(at: Path, name: str, set_id: str) -> None:
    """Activate the configuration set SET.

    \b
    tickrig rtc conf act ConfigSample0 fast
    """  # noqa: D301 - click wants the backspace
    request_system(at, "activate_set", name=name, set=set_id)


def _configuration(socket: Path, name: str) -> Any:
    (component,) = components(socket, name)
    return component["configuration"]


_DATAPORT: Final = "dataport."
_POLL_S: Final = 0.02

as_json = click.option("--json", "as_json", is_flag=True, help="Print the answer as JSON.")
_some_names = click.argument("names", nargs=-1, shell_complete=complete_component)
_names_needed = click.argument("names", nargs=-1, required=True, shell_complete=complete_component)


@click.command()
@_some_names
@click.option("-l", "--long", is_flag=True, help="Also show state, ports, rate and type.")
@click.option("-R", "--recursive", is_flag=True, help="Also show the ports of each component.")
@as_json
@at
def ls(at: Path, names: tuple[str, ...], long: bool, recursive: bool, as_json: bool) -> None:
    """List the components NAMES, or all components if none is named.

    With -l, a line contains state, two numbers, rate, type and name. The numbers, such as 3/1, are
    the number of ports and the number of connected ports.

    \b
    tickrig rtc ls -l
    """  # noqa: D301 - click wants the backspace
    described = components(at, *names)
    if as_json:
        click.echo(json_text(described))
        return
    for component in described:
        click.echo(_component_row(component) if long else component["name"])
        for port in component["ports"] if recursive else ():
            click.echo(_port_line(port))


@click.command()
@_names_needed
@click.option(
    "-l",
    "--long",
    is_flag=True,
    help="Also show properties of connectors, and the values of all sets.",
)
@as_json
@at
def cat(at: Path, names: tuple[str, ...], long: bool, as_json: bool) -> None:
    """Show the components NAMES: type, state, ports, connectors, configuration.

    \b
    tickrig rtc cat ConsoleIn0 -l
    """  # noqa: D301 - click wants the backspace
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
@click.option("--rate", "rate_hz", type=NumberRange(1e-6, 1e6), help="Rate in Hz.  [1000]")
@at
def create(at: Path, type_name: str, name: str, rate_hz: float | None) -> None:
    """Create a component of TYPE, and print its name, such as ConsoleIn0.

    \b
    tickrig rtc create ConsoleIn
    tickrig rtc create SeqOut Source0 --rate 100
    """  # noqa: D301 - click wants the backspace
    rate = {} if rate_hz is None else {"rate_hz": rate_hz}
    click.echo(request_system(at, "create", type=type_name, name=name, **rate)["name"])


@click.command()
@click.argument("first", shell_complete=complete_port)
@click.argument("second", shell_complete=complete_port)
@click.option(
    "-p",
    "--property",
    "properties",
    multiple=True,
    metavar="KEY=VALUE",
    help="Property of the connector; may be repeated.",
)
@click.option("-n", "--name", default="", help="Name of the connector.")
@at
def con(at: Path, first: str, second: str, properties: tuple[str, ...], name: str) -> None:
    """Connect the ports FIRST and SECOND.

    You may leave out the prefix `dataport.` of a property key.

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
    """End the connector between two PORTS, or all connectors of one port or of a component.

    \b
    tickrig rtc dis ConsoleIn0.out ConsoleOut0.in
    tickrig rtc dis ConsoleIn0
    """  # noqa: D301 - click wants the backspace
    request_system(at, "disconnect", ports=list(ports))


@click.command("exit")
@_names_needed
@at
def _exit(at: Path, names: tuple[str, ...]) -> None:
    """End the components NAMES, and their connectors.

    \b
    tickrig rtc exit ConsoleIn0
    """  # noqa: D301 - click wants the backspace
    for name in names:
        request_system(at, "delete", name=name)


@click.command(context_settings={"ignore_unknown_options": True})
@click.argument("port", shell_complete=complete_port)
@click.argument("value")
@at
def inject(at: Path, port: str, value: str) -> None:
    """Write VALUE to the InPort PORT, as an OutPort connected with it would.

    VALUE is JSON: an object with the fields of the port's data type. Missing fields have their
    default. A missing time stamp tm is the present time. If the type has a field data, VALUE may
    also be the value of this field alone. Octets are lists of numbers, and enumerators are names.

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
@click.option("-n", "count", type=click.IntRange(1), help="End after this many values.")
@click.option("--for", "duration", metavar="TIME", help="End after this time, such as 10s.")
@click.option("--jsonl", "--json", "as_json", is_flag=True, help="Print one JSON object per value.")
@at
def _print(at: Path, port: str, count: int | None, duration: str | None, as_json: bool) -> None:
    """Print what the OutPort PORT writes from now on, one value per line, until Ctrl-C.

    A line is the value's time in seconds and its data as JSON.

    \b
    tickrig rtc print ConsoleIn0.out
    tickrig rtc print SeqOut0.Long -n 10 --jsonl
    """  # noqa: D301 - click wants the backspace
    until_s = time.monotonic() + time_us("--for", duration) / 1e6 if duration else None
    try:
        for value in _values(at, port, count, until_s):
            click.echo(json_text(value) if as_json else _value_line(value))
    except KeyboardInterrupt:
        return


def _moving(name: str, verb: str, wanted: str, text: str) -> click.Command:
    """Return a command that requests a state of components, and waits until they are in it."""
    told = f"{text}, and wait until they are {wanted.capitalize()}."
    example = f"tickrig rtc {name} ConsoleIn0 ConsoleOut0"

    @click.command(name, help=f"{told}\n\n\b\n{example}")
    @_names_needed
    @click.option(
        "--wait", default="2s", help="How long to wait for the state; 0 does not wait.  [2s]"
    )
    @at
    def move(at: Path, names: tuple[str, ...], wait: str) -> None:
        wait_us = time_us("--wait", wait)
        for component in names:
            request_system(at, verb, name=component)
        for component in names:
            settle(at, component, wanted, wait_us)

    return move


_MOVES: Final = (
    _moving("act", "activate", "ACTIVE", "Activate the components NAMES"),
    _moving("deact", "deactivate", "INACTIVE", "Deactivate the components NAMES"),
    _moving("reset", "reset", "INACTIVE", "Reset the components NAMES from Error"),
)


def _property(word: str) -> tuple[str, str]:
    key, equals, value = word.partition("=")
    if not key or not equals:
        raise Refused(f"-p {word!r} is not KEY=VALUE")
    return (key if key.startswith(_DATAPORT) else _DATAPORT + key), value


def _values(socket: Path, port: str, count: int | None, until_s: float | None) -> Iterator[Any]:
    """Yield values until there are enough values, or the time is over."""
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
            time.sleep(_POLL_S)


def _report_lost(answer: Any, latest: Any) -> None:
    if lost := answer["latest"] - latest - len(answer["values"]):
        click.echo(f"{lost} values lost: they came faster than they were taken", err=True)


VERBS: Final = (ls, cat, create, con, dis, *_MOVES, _exit, inject, _print)


# The verbs of `tickrig rtc` about a system as a whole.

_FILES: Final = "tickrig.host.rtc.system.system_file"
"""Module that is loaded by its path, because most verbs do not need it."""


@click.command()
@click.argument("file", type=PATH, required=False)
@at
def save(at: Path, file: Path | None) -> None:
    """Write the present system to FILE, .toml or .xml. Without FILE, print it as TOML.

    \b
    tickrig rtc save system.toml
    """  # noqa: D301 - click wants the backspace
    file_format = "toml" if file is None else load(f"{_FILES}:file_format")(file)
    text = request_system(at, "save", format=file_format)["text"]
    if file is None:
        click.echo(text)
    else:
        load(f"{_FILES}:write_system")(text, file)


@click.command()
@as_json
@at
def status(at: Path, as_json: bool) -> None:
    """Show the number of components, the time, the number of late ticks and the longest delay.

    \b
    tickrig rtc status --json
    """  # noqa: D301 - click wants the backspace
    answer = {key: value for key, value in request_system(at, "status").items() if key != "ok"}
    if as_json:
        click.echo(json_text(answer))
        return
    for key in ("components", "now_us", "late_ticks", "late_us"):
        click.echo(f"{key} {answer[key]}")


@click.command()
@at
def stop(at: Path) -> None:
    """End the system.

    \b
    tickrig rtc stop
    """  # noqa: D301 - click wants the backspace
    request_system(at, "stop")


@click.command()
@click.argument("file", type=PATH)
@at
def check(at: Path, file: Path) -> None:
    """Compare the system with the system file FILE.

    FILE is TOML (.toml) or an RTSProfile (.xml). The command prints a line for each part of FILE
    that is missing or different in the system. The exit status is then 1. Additional parts of the
    system do not matter. With an RTSProfile, the states of the components are not compared, because
    an RTSProfile cannot hold states.

    \b
    tickrig rtc check system.toml
    """  # noqa: D301 - click wants the backspace
    text = request_system(at, "save", format=load(f"{_FILES}:file_format")(file))["text"]
    lines = load(f"{_FILES}:lacking")(file, text)
    for line in lines:
        click.echo(line)
    if lines:
        click.get_current_context().exit(1)


@click.command()
@at
def dot(at: Path) -> None:
    """Print the system as a graph in the language of Graphviz.

    \b
    tickrig rtc dot | dot -Tsvg -o system.svg
    """  # noqa: D301 - click wants the backspace
    click.echo(load("tickrig.host.rtc.system.dot:system_graph")(components(at)))


@click.command()
@at
def edit(at: Path) -> None:
    """Show the system as a picture on the terminal, and change it (extra tickrig[tui]).

    The picture has boxes with ports, and a wire for each connector. Arrows move from port to port.
    The keys a, d and r activate, deactivate and reset. The key m marks a port. The key c connects
    the marked port with the port under the cursor, and x disconnects. Tab goes to the
    configuration, and e edits it. F1 shows the keys.

    \b
    tickrig rtc edit
    tickrig rtc edit --at /tmp/cart
    """  # noqa: D301 - click wants the backspace
    try:
        edit_system = load("tickrig.host.rtc.editor.app:edit_system")
    except ImportError as error:
        raise Refused(f"the editor needs Textual: pip install 'tickrig[tui]' ({error})") from None
    edit_system(at)


SYSTEM_VERBS: Final = (save, status, stop, check, dot, edit)
