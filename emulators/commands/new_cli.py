"""The command `tickrig new`: begin a package of one's own."""

from __future__ import annotations

import keyword
import re
import shutil
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import click

from tickrig.host.cli.options import PATH
from tickrig.host.cli.refused import Refused, refuse_path
from tickrig.host.cli.start import loading
from tickrig.host.text.whole_file import write_whole

_NAME: Final = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")


@click.group()
def new() -> None:
    """Begin a package that adds something to tickrig."""


@new.command()
@click.argument("name")
@click.option("--in", "folder", type=PATH, default=".", help="Where to make it.  [.]")
def device(name: str, folder: Path) -> None:
    """Write the package of a device on a serial line into a new folder NAME.

    It runs at once, and is yours to change:

    \b
    tickrig new device lamp
    pip install -e lamp
    tickrig emu lamp --link /tmp/lamp
    """  # noqa: D301 - click wants the backspace
    with loading():
        from tickrig.emulators.commands.device_type import DEVICES  # noqa: PLC0415 - slow
        from tickrig.emulators.commands.new_device import files  # noqa: PLC0415 - slow

    module = name.replace("-", "_")
    if not _NAME.fullmatch(name):
        wanted = "a small letter, then small letters, digits and -, as my-lamp"
        raise Refused(f"{name!r} is no name: {wanted}")
    if keyword.iskeyword(module):
        raise Refused(f"{name!r} is a word of Python, and no module: take another, as my-{name}")
    spec = find_spec(module)
    if spec is not None and spec.origin is not None:
        raise Refused(f"{name!r} is the name of a module that is there already")
    if name in DEVICES.names():
        raise Refused(f"there is a device {name!r} already: tickrig emu {name}")
    place = folder / name
    try:
        place.mkdir()
        _write(place, files(name, module))
    except OSError as error:
        refuse_path("folder", error)
    for path in files(name, module):
        click.echo(place / path)


def _write(place: Path, texts: Mapping[str, str]) -> None:
    """Write the files of a package into its folder, which goes again if they cannot be written."""
    try:
        for path, text in texts.items():
            file = place / path
            file.parent.mkdir(exist_ok=True)
            write_whole(file, text)
    except OSError:
        shutil.rmtree(place, ignore_errors=True)
        raise
