"""The command `tickrig new`: create a package that extends tickrig."""

from __future__ import annotations

import keyword
import re
import shutil
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from string import Template
from typing import Final

import click

from tickrig.emulators.commands.run_options import device_types
from tickrig.host.cli.messages import Refused, refuse_path
from tickrig.host.cli.options import PATH
from tickrig.host.text.whole_file import write_whole

_NAME: Final = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")


@click.group()
def new() -> None:
    """Create a package that extends tickrig.

    \b
    tickrig new device lamp
    """  # noqa: D301 - click wants the backspace


@new.command()
@click.argument("name")
@click.option("--in", "folder", type=PATH, default=".", help="Folder for the new package.  [.]")
@click.option("--binary", is_flag=True, help="Exchange frames with a length and a CRC, not lines.")
def device(name: str, folder: Path, binary: bool) -> None:
    """Write the package of a device on a serial line into a new folder NAME.

    The package runs at once, and you can change it:

    \b
    tickrig new device lamp
    pip install -e lamp
    tickrig emu lamp --link /tmp/lamp
    tickrig new device sensor --binary       answers frames, not lines
    """  # noqa: D301 - click wants the backspace
    module = name.replace("-", "_")
    if not _NAME.fullmatch(name):
        wanted = "a small letter, then small letters, digits and -, as my-lamp"
        raise Refused(f"{name!r} is no name: {wanted}")
    if keyword.iskeyword(module):
        raise Refused(f"{name!r} is a word of Python, and no module: take another, as my-{name}")
    spec = find_spec(module)
    if spec is not None and spec.origin is not None:
        raise Refused(f"{name!r} is the name of a module that is there already")
    if name in device_types().names():
        raise Refused(f"there is a device {name!r} already: tickrig emu {name}")
    place, texts = folder / name, files(name, module, binary=binary)
    try:
        place.mkdir()
        _write(place, texts)
    except OSError as error:
        refuse_path("folder", error)
    for path in texts:
        click.echo(place / path)


def _write(place: Path, texts: Mapping[str, str]) -> None:
    """Write the files of a package into its folder; delete the folder if the write fails."""
    try:
        for path, text in texts.items():
            file = place / path
            file.parent.mkdir(exist_ok=True)
            write_whole(file, text)
    except OSError:
        shutil.rmtree(place, ignore_errors=True)
        raise


# What `tickrig new device` writes: a package with one small device on a serial line.

_TEMPLATES: Final = Path(__file__).with_name("template")

_OF_LINES: Final = {
    "imports": "",
    "fields": 'DeviceField(name="greeting", default="ready", help="First line that it sends."),',
    "line": "baud=115_200",
}
"""Texts in the device type of a device that answers lines."""

_OF_FRAMES: Final = {
    "imports": "from $module.frames import FRAMES\n",
    "fields": """
        DeviceField(
            name="serial", kind=int, low=0, high=65_535, default=0x1234, help="Serial number."
        ),
    """,
    "line": "baud=115_200, splitter=FRAMES",
}
"""Texts in the device type of a device that answers frames with a length and a CRC."""


def files(name: str, module: str, *, binary: bool = False) -> dict[str, str]:
    """Return the files of the package that `tickrig new device` writes.

    Args:
        name: name of the device for `tickrig emu`.
        module: name of the device's Python module.
        binary: whether the device exchanges frames instead of lines.

    Returns:
        The text of each file, by its path in the folder of the package.
    """
    words = {"name": name, "module": module, "cls": module.title().replace("_", "")}
    kind = {
        key: Template(text).substitute(words)
        for key, text in (_OF_FRAMES if binary else _OF_LINES).items()
    }
    form = "binary_" * binary
    templates = {
        "pyproject.toml": "pyproject.toml",
        "README.md": "README.md",
        f"{module}/device.py": f"{form}device.py",
        f"{module}/device_type.py": "device_type.py",
        f"tests/test_{module}.py": f"{form}test.py",
    }
    if binary:
        templates[f"{module}/frames.py"] = "frames.py"
        templates[f"tests/test_{module}_fuzz.py"] = "binary_fuzz_test.py"
    texts = {path: _template(file) for path, file in templates.items()}
    texts[f"{module}/__init__.py"] = '"""An emulated $name, for tickrig."""\n'
    return {path: Template(text).substitute(words, **kind) for path, text in texts.items()}


def _template(file: str) -> str:
    return (_TEMPLATES / f"{file}.txt").read_text("utf-8")
