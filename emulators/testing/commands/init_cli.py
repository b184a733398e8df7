"""The command `tickrig init`: a rig file to begin with."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Final

import click

from tickrig.host.cli.messages import Refused, refuse_path
from tickrig.host.cli.options import PATH
from tickrig.host.cli.start import loading

_RIG: Final = "rig.toml"
_STANDARD_OUTPUT: Final = "-"


def _complete_type(context: click.Context, parameter: click.Parameter, begun: str) -> list[str]:
    with loading():
        from tickrig.emulators.canopen.choices import MODELS  # noqa: PLC0415 - slow
        from tickrig.emulators.commands.device_type import DEVICES  # noqa: PLC0415 - slow

    return [name for name in (*DEVICES.names(), *MODELS) if name.startswith(begun)]


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
def init(types: tuple[str, ...], file: Path) -> None:
    """Write a rig file to begin with: devices, and all that can be said of them.

    It checks and runs as it is; comments propose inputs, faults, ports. A file that is
    there is left alone; - is standard output.

    \b
    tickrig init
    tickrig init --device epos --device epos --device urg -o robot.toml
    tickrig check rig.toml
    """  # noqa: D301 - click wants the backspace
    with loading():
        from tickrig.emulators.testing.commands.rig_template import (  # noqa: PLC0415 - slow
            TypeRefusedError,
            rig_template,
        )

    on_output = str(file) == _STANDARD_OUTPUT
    folder = Path() if on_output else file.parent
    try:
        text = rig_template(types or ("rrc",), _RIG if on_output else file.name, folder)
    except TypeRefusedError as error:
        raise Refused(f"--device {error}") from None
    if on_output:
        click.echo(text, nl=False)
        return
    from tickrig.host.text.whole_file import write_whole  # noqa: PLC0415 - a TAB needs none

    if file.exists():
        why = "is there already, and is left alone: -o FILE writes another one"
        raise Refused(f"file {file} {why}")
    try:
        write_whole(file, text)
    except FileNotFoundError:
        why = "cannot be made there" if file.parent.is_dir() else f"no directory {file.parent}"
        raise Refused(f"file {file}: {why}") from None
    except OSError as error:
        refuse_path("file", error)
    click.echo(file)
    words = shlex.quote(str(file))
    click.echo(f"next: edit it; tickrig check {words}; tickrig run {words}", err=True)
