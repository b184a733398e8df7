"""The command `ucode-resolver`."""

from __future__ import annotations

from typing import Any

import click

from tickrig.host.cli.options import PATH, HarmlessCommand, version_option, works_in


@click.command(cls=HarmlessCommand)
@click.argument("table", type=PATH, required=False)
@click.option(
    "--port",
    type=click.IntRange(0, 65_535),
    default=8_640,
    help="Port on loopback; 0 selects a free one. [8640]",
)
@click.option("--control", type=PATH, help="Control socket to serve, for 'tickrig ctl'.")
@click.option(
    "--fault",
    "faults",
    multiple=True,
    metavar="NAME[@FROM[-TO]]",
    help="Inject a fault: unreachable, slow, unknown_ucode or broken; may be repeated.",
)
@click.option("--example", is_flag=True, help="Print an example table, and exit.")
@version_option()
@works_in("tickrig.emulators.tkernel.commands.http_service:run_service")
def main(**options: Any) -> None:
    """Serve a TABLE of ucodes over HTTP on loopback, until Ctrl-C.

    A ucode is a number that identifies a place or a thing. GET /ucodes/UCODE answers with the
    address of the information about a ucode. GET /contents/NAME answers with the information. The
    HTTP status is 404 if there is no such address or information.

    \b
    ucode-resolver --example > places.toml
    ucode-resolver places.toml --control /tmp/resolver.ctl
    tickrig ctl /tmp/resolver.ctl fault unreachable
    tickrig ctl /tmp/resolver.ctl fault slow@0s-10s
    tickrig ctl /tmp/resolver.ctl get requests found
    """  # noqa: D301 - click wants the backspace
