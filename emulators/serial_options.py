"""The options that the command lines of all serial emulators share."""

from __future__ import annotations

from typing import Final

import click

from tickrig.emulators.run_options import run_options
from tickrig.host.cli.options import PATH, Decorator, add_options


def line_options(wire_faults: str) -> Decorator:
    """Return a decorator that adds the options of a device on a serial line, and --version."""
    return add_options(
        click.option("--link", type=PATH, help="Symbolic link to make to the terminal."),
        click.option("--trace", type=PATH, help="File to record the run in, for 'tickrig replay'."),
        run_options(wire_faults),
    )


serial_options: Final[Decorator] = add_options(
    click.option("--panel", is_flag=True, help="Show an operator panel in this terminal."),
    line_options("flip, drop, dup, cut"),
)
"""Add the fields of `serial_run.Options` as options, and --version."""
