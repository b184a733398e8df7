"""The verbs of `tickrig rtc` about a system as a whole."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import click

from tickrig.host.cli.options import PATH
from tickrig.host.cli.start import loading
from tickrig.host.rtc.commands.request import at, components, request_system
from tickrig.host.rtc.commands.verbs import as_json
from tickrig.host.text.page_text import json_text


@click.command()
@click.argument("file", type=PATH, required=False)
@at
def save(at: Path, file: Path | None) -> None:
    """Write the system as it is to FILE, .toml or .xml; without FILE print it as TOML."""
    with loading():
        from tickrig.host.rtc.commands.system_file import file_format, write_system  # noqa: PLC0415

    text = request_system(at, "save", format="toml" if file is None else file_format(file))["text"]
    if file is None:
        click.echo(text)
    else:
        write_system(text, file)


@click.command()
@as_json
@at
def status(at: Path, as_json: bool) -> None:
    """Show how the run is going: time, late ticks."""
    answer = {key: value for key, value in request_system(at, "status").items() if key != "ok"}
    if as_json:
        click.echo(json_text(answer))
        return
    for key in ("components", "now_us", "late_ticks", "late_us"):
        click.echo(f"{key} {answer[key]}")


@click.command()
@at
def stop(at: Path) -> None:
    """End the system."""
    request_system(at, "stop")


@click.command()
@click.argument("file", type=PATH)
@at
def check(at: Path, file: Path) -> None:
    """Compare the system with FILE, .toml or .xml: exit status 1 and a line for all it lacks.

    States are compared with a .toml file; RTSProfile has none. What is there
    beside it does not matter.
    """
    with loading():
        from tickrig.host.rtc.commands.system_file import file_format, read_system  # noqa: PLC0415
        from tickrig.host.rtc.system.rts_profile import parse_rts_profile  # noqa: PLC0415
        from tickrig.host.rtc.system.system import differences  # noqa: PLC0415
        from tickrig.host.rtc.system.system_toml import parse_toml  # noqa: PLC0415

    parse = parse_rts_profile if file_format(file) == "xml" else parse_toml
    wanted = read_system(file)
    found = parse(request_system(at, "save", format=file_format(file))["text"])
    lines = tuple(differences(wanted, found))
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
    from tickrig.host.rtc.system.dot import Edge, write_dot  # noqa: PLC0415

    described = components(at)
    ends = dict.fromkeys(
        tuple(connector["ports"])
        for component in described
        for port in component["ports"]
        for connector in port["connectors"]
    )
    click.echo(write_dot(map(_box, described), (Edge(*pair) for pair in ends)))


def _box(component: Any) -> Any:
    from tickrig.host.rtc.system.dot import Box  # noqa: PLC0415

    ins, outs = list[str](), list[str]()
    for port in component["ports"]:
        side = ins if port["kind"] == "DataInPort" else outs
        side.append(port["name"].rpartition(".")[2])
    state = component["state"].capitalize()
    return Box(component["name"], f"{component['type']} {state}", tuple(ins), tuple(outs))


SYSTEM_VERBS: Final = (save, status, stop, check, dot)
