"""The command `tickrig check`: what a rig file or a bus.yml says, or all that is wrong with it."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Final

import click

from tickrig.host.cli.messages import say
from tickrig.host.cli.options import PATH
from tickrig.host.cli.start import loading, raise_of_output

_MISTAKES: Final = 1
_UNREADABLE: Final = 2
_EDS_ENDINGS: Final = (".eds", ".dcf", ".xdd", ".xdc")
_LOOKED_AT: Final = 65_536
"""Bytes at its beginning by which a bus.yml is known."""


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=PATH)
@click.option("--strict", is_flag=True, help="Warnings count, too: a bus.yml has some.")
@click.pass_context
def check(context: click.Context, /, files: tuple[Path, ...], strict: bool) -> None:
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
    context.exit(max([_check(file, strict) for file in files]))


def _check(file: Path, strict: bool) -> int:
    """Check a file, and return the exit status."""
    if file.suffix.lower() in _EDS_ENDINGS:
        say(f"Error: {file}: an EDS, no rig file or bus.yml; use: canmon eds check {file}")
        return _UNREADABLE
    kind = _kind(file)
    if "System Definition" in kind:
        say(f"Error: {file}: no rig file or bus.yml, but {kind}")
        return _UNREADABLE
    try:
        return _check_bus(file, strict) if kind else _check_rig(file)
    except OSError as error:
        raise_of_output(error)
        say(f"Error: {file}: {error.strerror}")
        return _UNREADABLE


def _kind(file: Path) -> str:
    """Say what a file in YAML is, empty for others; a pipe is not looked into: it is read once."""
    from tickrig.host.canopen.bus_file.bus_file import check_of  # noqa: PLC0415 - slow

    with suppress(OSError):
        if file.is_file():
            with file.open("rb") as opened:
                return check_of(opened.read(_LOOKED_AT), file)
    return ""


def _check_bus(file: Path, strict: bool) -> int:
    with loading():
        from tickrig.emulators.testing.commands.check_bus import check_bus  # noqa: PLC0415 - slow

    try:
        return check_bus(file, strict=strict)
    except ImportError as error:
        say(f"Error: {file}: {error}")
        return _UNREADABLE


def _check_rig(file: Path) -> int:
    with loading():
        from tickrig.emulators.testing.rig_file.plan import summary  # noqa: PLC0415
        from tickrig.emulators.testing.rig_file.reader import read_rig_file  # noqa: PLC0415 - slow
        from tickrig.emulators.testing.rig_file.schema import RigFileError  # noqa: PLC0415

    try:
        first, *wires = summary(read_rig_file(file))
    except RigFileError as error:
        click.echo(str(error))
        return _MISTAKES
    click.echo("\n".join([f"{file}: ok: {first}", *wires]))
    return 0
