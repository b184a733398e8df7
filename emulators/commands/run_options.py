"""The options that the command lines of all emulators share."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import click

from tickrig.host.cli.options import PATH, Decorator, add_options, version_option

Faults = Callable[[click.Context], Iterable[str]]
"""Gives the faults of a device as the command line has it so far."""


def run_options(wire_faults: str, device_faults: Faults) -> Decorator:
    """Return a decorator that adds the fields of `run.RunOptions`, and --version.

    Args:
        wire_faults: names with commas between.
        device_faults: for the shell to complete.
    """

    def complete(context: click.Context, option: click.Parameter, begun: str) -> list[str]:
        names = [*wire_faults.split(", "), *device_faults(context)]
        return [name for name in names if name.startswith(begun)]

    return add_options(
        click.option("--scenario", type=PATH, help="Scenario to play; - reads standard input."),
        click.option("--control", type=PATH, help="Control socket to serve, for 'tickrig ctl'."),
        click.option(
            "--fault",
            "faults",
            multiple=True,
            metavar="NAME[=RATE][@FROM[-TO]]",
            shell_complete=complete,
            help=f"Fault of the wire ({wire_faults}) or of the device; may be repeated.",
        ),
        click.option("--seed", type=int, default=0, help="Seed of the wire faults' chance.  [0]"),
        click.option("-v", "--verbose", count=True, help="Show events; -vv shows every line."),
        version_option(),
    )
