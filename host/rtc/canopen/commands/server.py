"""The command `rtc-canopen-server`."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import click

from tickrig.host.cli.can_options import BusCommand, bus_options
from tickrig.host.cli.engine_options import openrtm_options, ros2_options, take_engines
from tickrig.host.cli.messages import NEEDS_YAML, Refused
from tickrig.host.cli.options import PATH, Decorator, version_option
from tickrig.host.cli.start import load
from tickrig.host.text.values import parse_time_us
from tickrig.wire.instant import NEVER

component_option: Final[Decorator] = click.option(
    "--component",
    "components",
    multiple=True,
    metavar="NAME=FILE.py:Class",
    help="Run an RT component in addition to the proxies, Active at once; may be repeated.",
)


@click.command(cls=BusCommand)
@click.argument("file", type=PATH)
@bus_options
@component_option
@click.option(
    "--log",
    type=PATH,
    help="Write the events to a file, one JSON object per line (- is standard output).",
)
@click.option(
    "--for", "span", metavar="TIME", help="End after this time, such as 10s.  [at Ctrl-C]"
)
@click.option("--control", type=PATH, help="Control socket to serve, for 'tickrig ctl'.")
@click.option("--start", is_flag=True, help="Activate all nodes in the start order.")
@click.option("--check", is_flag=True, help="Check FILE and its EDS files, and exit.")
@click.option("--dot", is_flag=True, help="Draw FILE as a graph for Graphviz, and exit.")
@click.option("-q", "--quiet", is_flag=True, help="Do not print the events to standard error.")
@openrtm_options
@ros2_options
@version_option()
def main(file: Path, span: str | None, **options: Any) -> None:
    """Manage the CANopen nodes of a System Definition as RT components.

    FILE is YAML or JSON. The bus is that of FILE unless -i and -c name another bus. The server is
    NMT master and heartbeat consumer. It sets up the nodes, makes a proxy of each node, links their
    PDOs and connects their ports, and detects when nodes come and go. At Ctrl-C, the server resets
    the communication of the nodes.

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
    try:
        run_server = load("tickrig.host.rtc.canopen.commands.opening:run_server")
    except ModuleNotFoundError:
        raise Refused(NEEDS_YAML) from None
    run_server(file, span_us, engines, options)


def _span_us(span: str | None) -> int:
    try:
        return NEVER if span is None else parse_time_us(span)
    except ValueError as error:
        raise Refused(f"--for: {error}") from None
