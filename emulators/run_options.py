"""The options that the command lines of all emulators share."""

from __future__ import annotations

import click

from tickrig.host.cli.options import PATH, Decorator, add_options, version_option


def run_options(wire_faults: str) -> Decorator:
    """Return a decorator that adds the fields of `run.RunOptions`, and --version."""
    return add_options(
        click.option("--scenario", type=PATH, help="Scenario to play; - reads standard input."),
        click.option("--control", type=PATH, help="Control socket to serve, for 'tickrig ctl'."),
        click.option(
            "--fault",
            "faults",
            multiple=True,
            metavar="NAME[=RATE][@FROM[-TO]]",
            help=f"Fault of the wire ({wire_faults}) or of the device; may be repeated.",
        ),
        click.option("--seed", type=int, default=0, help="Seed of the wire faults' chance.  [0]"),
        click.option("-v", "--verbose", count=True, help="Show events; -vv shows every line."),
        version_option(),
    )
