"""The options that the command lines of all serial emulators share."""

from __future__ import annotations

from collections.abc import Iterator

import click

from tickrig.emulators.commands.run_options import run_options
from tickrig.host.cli.options import PATH, Decorator, add_options
from tickrig.host.cli.start import load


def line_options(wire_faults: str, terminals: str) -> Decorator:
    """Return a decorator that adds the options of a device on a serial line, and --version.

    Args:
        wire_faults: names with commas between.
        terminals: the module with the physical side of the device, as INPUTS.
    """

    def device_faults(context: click.Context) -> Iterator[str]:
        inputs = load(f"{terminals}:INPUTS")
        return (item.name for item in inputs if item.type.value == "fault")

    return add_options(
        click.option("--link", type=PATH, help="Symbolic link to make to the terminal."),
        click.option("--trace", type=PATH, help="File to record the run in, for 'tickrig replay'."),
        run_options(wire_faults, device_faults),
    )
