"""`tickrig rtc conf`: the configuration sets of a component."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from tickrig.host.cli.refused import Refused
from tickrig.host.rtc.commands.request import at, complete_component, components, request_system
from tickrig.host.rtc.commands.texts import configuration_lines

component_name = click.argument("name", shell_complete=complete_component)


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
@component_name
@click.option("-l", "--long", is_flag=True, help="Show the values of each set.")
@at
def list_(at: Path, name: str, long: bool) -> None:
    """List the parameters of the component NAME with the values that hold, and its sets."""
    for line in configuration_lines(_configuration(at, name), long=long):
        click.echo(line.removeprefix("  "))


@conf.command()
@component_name
@click.argument("parameter")
@at
def get(at: Path, name: str, parameter: str) -> None:
    """Print the value of PARAMETER that holds."""
    values = {one["name"]: one["value"] for one in _configuration(at, name)["parameters"]}
    if parameter not in values:
        raise Refused(f"no parameter {parameter!r}; known: {', '.join(values) or 'none'}")
    click.echo(values[parameter])


@conf.command("set", context_settings={"ignore_unknown_options": True})
@component_name
@click.argument("parameter")
@click.argument("value")
@click.option("--set", "set_id", default="", help="The set to change.  [the active one]")
@at
def set_(at: Path, name: str, parameter: str, value: str, set_id: str) -> None:
    """Change PARAMETER to VALUE; elements of a list have commas between."""
    request_system(at, "set_parameter", name=name, parameter=parameter, value=value, set=set_id)


@conf.command()
@component_name
@click.argument("set_id", metavar="SET")
@at
def act(at: Path, name: str, set_id: str) -> None:
    """Let the values of SET hold."""
    request_system(at, "activate_set", name=name, set=set_id)


def _configuration(socket: Path, name: str) -> Any:
    (component,) = components(socket, name)
    return component["configuration"]
