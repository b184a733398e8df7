"""The options that the command lines of all serial emulators share."""

from __future__ import annotations

from typing import Final

import click

from tickrig.emulators.run_options import PATH, Decorator, add_options, run_options

serial_options: Final[Decorator] = add_options(
    click.option("--link", type=PATH, help="Symbolic link to make to the terminal."),
    click.option("--trace", type=PATH, help="File to record the run in, for 'tickrig replay'."),
    click.option("--panel", is_flag=True, help="Show an operator panel in this terminal."),
    run_options("flip, drop, dup, cut"),
)
"""Add the fields of `serial_run.Options` as options, and --version."""
