"""The verbs of `tickrig rtc` that ask once."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

import click

from tickrig.emulators.rtc.at import ask_system, at, components
from tickrig.emulators.rtc.completion import complete_component, complete_port, complete_type
from tickrig.emulators.rtc.settle import settle
from tickrig.emulators.rtc.texts import component_lines, component_row, port_line
from tickrig.host.cli.options import PATH, NumberRange, add_options, time_us
from tickrig.host.cli.refused import Refused
from tickrig.host.cli.start import loading

DATAPORT: Final = "dataport."

as_json = click.option("--json", "as_json", is_flag=True, help="Print the answer as JSON.")
some_names = click.argument("names", nargs=-1, shell_complete=complete_component)
names_needed = click.argument("names", nargs=-1, required=True, shell_complete=complete_component)
moving = add_options(
    names_needed,
    click.option("--wait", default="2s", help="How long to wait for it; 0 asks only.  [2s]"),
    at,
)


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
        click.echo(json.dumps(described))
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
        click.echo(json.dumps(described))
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
    click.echo(ask_system(at, "create", type=type_name, name=name, **rate)["name"])


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
    ask_system(at, "connect", ports=[first, second], properties=given, name=name)


@click.command()
@click.argument("ports", nargs=-1, required=True, shell_complete=complete_port)
@at
def dis(at: Path, ports: tuple[str, ...]) -> None:
    """End the connector between two PORTS, all of one port, or all of a component."""
    ask_system(at, "disconnect", ports=list(ports))


@click.command()
@moving
def act(at: Path, names: tuple[str, ...], wait: str) -> None:
    """Activate the components NAMES, and wait until they are Active."""
    _move(at, "activate", names, "ACTIVE", wait)


@click.command()
@moving
def deact(at: Path, names: tuple[str, ...], wait: str) -> None:
    """Deactivate the components NAMES, and wait until they are Inactive."""
    _move(at, "deactivate", names, "INACTIVE", wait)


@click.command()
@moving
def reset(at: Path, names: tuple[str, ...], wait: str) -> None:
    """Reset the components NAMES from Error, and wait until they are Inactive."""
    _move(at, "reset", names, "INACTIVE", wait)


@click.command("exit")
@names_needed
@at
def exit_(at: Path, names: tuple[str, ...]) -> None:
    """End the components NAMES, and their connectors."""
    for name in names:
        ask_system(at, "delete", name=name)


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
    except ValueError:
        raise Refused(f"{value!r} is not JSON, as 5, [1, 2], true or '\"text\"'") from None
    ask_system(at, "inject", port=port, value=given)


@click.command()
@click.argument("file", type=PATH, required=False)
@at
def save(at: Path, file: Path | None) -> None:
    """Write the system as it is to FILE, .toml or .xml; without FILE print it as TOML."""
    with loading():
        from tickrig.emulators.rtc.system_file import file_format, write_system  # noqa: PLC0415

    text = ask_system(at, "save", format="toml" if file is None else file_format(file))["text"]
    if file is None:
        click.echo(text)
    else:
        write_system(text, file)


@click.command()
@as_json
@at
def status(at: Path, as_json: bool) -> None:
    """Show how the run is going: time, late ticks."""
    answer = {key: value for key, value in ask_system(at, "status").items() if key != "ok"}
    if as_json:
        click.echo(json.dumps(answer))
        return
    for key in ("components", "now_us", "late_ticks", "late_us"):
        click.echo(f"{key} {answer[key]}")


@click.command()
@at
def stop(at: Path) -> None:
    """End the system."""
    ask_system(at, "stop")


def _move(socket: Path, verb: str, names: tuple[str, ...], wanted: str, wait: str) -> None:
    wait_us = time_us("--wait", wait)
    for name in names:
        ask_system(socket, verb, name=name)
    for name in names:
        settle(socket, name, wanted, wait_us)


def _property(word: str) -> tuple[str, str]:
    key, equals, value = word.partition("=")
    if not key or not equals:
        raise Refused(f"-p {word!r} is not KEY=VALUE")
    return (key if key.startswith(DATAPORT) else DATAPORT + key), value


VERBS: Final = (ls, cat, create, con, dis, act, deact, reset, exit_, inject, save, status, stop)
