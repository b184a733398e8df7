"""The command `tickrig check`: the content of a rig file or bus.yml, or all its errors."""

from __future__ import annotations

from typing import Any

import click

from tickrig.host.cli.options import PATH, works_in


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=PATH)
@click.option("--strict", is_flag=True, help="Count warnings of a bus.yml as errors, too.")
@works_in("tickrig.emulators.testing.commands.check:check_files")
def check(**options: Any) -> None:
    """Check rig files and bus.yml: list the devices on the bench, or all errors.

    Each error is a line FILE:LINE: REASON. Each device is made once to check its options, inputs
    and faults. Therefore a FILE.py in the rig file is run. No port or bus is opened. The bus.yml of
    dcfgen and ros2_canopen is recognised by its content, and checked against its EDS files. The
    exit status is 0 without errors, 1 with errors, and 2 if a file cannot be read.

    \b
    tickrig check rig.toml
    tickrig check benches/*.toml
    tickrig check config/bus.yml --strict
    """  # noqa: D301 - click wants the backspace
