"""The command `tickrig check`: what a rig file or a bus.yml says, or all that is wrong with it."""

from __future__ import annotations

from typing import Any

import click

from tickrig.host.cli.options import PATH, works_in


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=PATH)
@click.option("--strict", is_flag=True, help="Warnings count, too: a bus.yml has some.")
@works_in("tickrig.emulators.testing.commands.check:check_files")
def check(**options: Any) -> None:
    """Check rig files and bus.yml: say what is on the bench, or all that is wrong.

    Each mistake is a line FILE:LINE: REASON. Devices are made once to see that their
    options, inputs and faults are right, so a FILE.py that one names is run; nothing is
    opened. The bus.yml of dcfgen and ros2_canopen is known by its content, and held
    against the EDS files that it names.
    Exit status 0: all is well; 1: there are mistakes; 2: a file cannot be read.

    \b
    tickrig check rig.toml
    tickrig check benches/*.toml
    tickrig check config/bus.yml --strict
    """  # noqa: D301 - click wants the backspace
