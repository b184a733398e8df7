"""The command `tickrig init`: write an initial rig file."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import click

from tickrig.emulators.commands.run_options import device_types
from tickrig.host.cli.options import PATH, works_in
from tickrig.host.cli.start import load

_RIG: Final = "rig.toml"


def _complete_type(context: click.Context, parameter: click.Parameter, begun: str) -> list[str]:
    names = (*device_types().names(), *load("tickrig.emulators.canopen.choices:MODELS"))
    return [name for name in names if name.startswith(begun)]


@click.command()
@click.option(
    "--device",
    "types",
    multiple=True,
    metavar="TYPE",
    shell_complete=_complete_type,
    help="Device type, CANopen model, EDS or DCF file, or FILE.py:Class; may be repeated.  [rrc]",
)
@click.option("-o", "--output", "file", type=PATH, default=_RIG, help=f"File to write.  [{_RIG}]")
@works_in("tickrig.emulators.testing.commands.rig_template:init")
def init(types: tuple[str, ...], file: Path) -> None:
    """Write an initial rig file: devices with all their options.

    The file is valid and runs unchanged. Comments in the file propose inputs, faults and ports. An
    existing file is not changed. With - as FILE, the command writes to standard output.

    \b
    tickrig init
    tickrig init --device epos --device epos --device urg -o robot.toml
    tickrig check rig.toml
    """  # noqa: D301 - click wants the backspace
