"""The command `tickrig check`: what a rig file says, or all that is wrong with it."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import click

from tickrig.host.cli.messages import say
from tickrig.host.cli.options import PATH
from tickrig.host.cli.start import loading

MISTAKES: Final = 1
UNREADABLE: Final = 2


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=PATH)
@click.pass_context
def check(context: click.Context, /, files: tuple[Path, ...]) -> None:
    """Check rig files: say what is on the bench, or all that is wrong.

    Each mistake is a line FILE:LINE: REASON. Devices are made once to see that their
    options, inputs and faults are right, so a FILE.py that one names is run; nothing is
    opened. Exit status 0: all is well; 1: there are mistakes; 2: a file cannot be read.

    \b
    tickrig check rig.toml
    tickrig check benches/*.toml
    """  # noqa: D301 - click wants the backspace
    context.exit(max(map(_check, files)))


def _check(file: Path) -> int:
    """Check a file, and return the exit status."""
    with loading():
        from tickrig.emulators.testing.rig_file.reader import read_rig_file  # noqa: PLC0415 - slow
        from tickrig.emulators.testing.rig_file.section import RigFileError  # noqa: PLC0415
        from tickrig.emulators.testing.rig_file.summary import summary  # noqa: PLC0415

    try:
        first, *wires = summary(read_rig_file(file))
    except RigFileError as error:
        click.echo(str(error))
        return MISTAKES
    except OSError as error:
        say(f"Error: {file}: {error.strerror}")
        return UNREADABLE
    click.echo("\n".join([f"{file}: ok: {first}", *wires]))
    return 0
