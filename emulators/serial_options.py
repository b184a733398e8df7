"""The options that the command lines of all serial emulators share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from tickrig import __version__

PATH = click.Path(path_type=Path)


def serial_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the fields of `serial_run.Options` as options, and --version."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


_OPTIONS = (
    click.option("--link", type=PATH, help="Symbolic link to make to the terminal."),
    click.option("--scenario", type=PATH, help="Scenario to play; - reads standard input."),
    click.option("--control", type=PATH, help="Control socket to serve, for 'tickrig ctl'."),
    click.option(
        "--fault",
        "faults",
        multiple=True,
        metavar="NAME[=RATE][@FROM[-TO]]",
        help="Fault of the wire (flip, drop, dup, cut) or of the device; may be repeated.",
    ),
    click.option("--seed", type=int, default=0, help="Seed of the wire faults' chance.  [0]"),
    click.option("--trace", type=PATH, help="File to record the run in, for 'tickrig replay'."),
    click.option("--panel", is_flag=True, help="Show an operator panel in this terminal."),
    click.option("-v", "--verbose", count=True, help="Show events; -vv shows every line."),
    click.version_option(__version__, message="%(prog)s (tickrig) %(version)s"),
)
