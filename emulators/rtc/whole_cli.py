"""The verbs of `tickrig rtc` that look at a system as a whole."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import click

from tickrig.emulators.rtc.at import ask_system, at, components
from tickrig.host.cli.options import PATH
from tickrig.host.cli.start import loading


@click.command()
@click.argument("file", type=PATH)
@at
def check(at: Path, file: Path) -> None:
    """Compare the system with FILE, .toml or .xml: exit status 1 and a line for all it lacks.

    States are compared with a .toml file; RTSProfile has none. What is there
    beside it does not matter.
    """
    with loading():
        from tickrig.emulators.rtc.system_file import file_format, read_system  # noqa: PLC0415
        from tickrig.host.rtc.system.compare import differences  # noqa: PLC0415
        from tickrig.host.rtc.system.rts_profile import parse_rts_profile  # noqa: PLC0415
        from tickrig.host.rtc.system.system_toml import parse_toml  # noqa: PLC0415

    parse = parse_rts_profile if file_format(file) == "xml" else parse_toml
    wanted = read_system(file)
    found = parse(ask_system(at, "save", format=file_format(file))["text"])
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


WHOLE: Final = (check, dot)
