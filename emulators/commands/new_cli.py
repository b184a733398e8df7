"""The command `tickrig new`: begin a package of one's own."""

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


# What `tickrig new device` writes: a package with one small device on a serial line.

_PYPROJECT: Final = """\
[build-system]
requires = ["setuptools>=77"]
build-backend = "setuptools.build_meta"

[project]
name = "$name"
version = "0.1.0"
description = "An emulated $name, for tickrig"
requires-python = ">=3.11"
dependencies = ["tickrig"]

[project.optional-dependencies]
test = ["tickrig[test]"]

[project.entry-points."tickrig.devices"]
$name = "$module.device_type:DEVICE"

[tool.setuptools]
packages = ["$module"]
"""

_README: Final = """\
# $name

An emulated device for [tickrig](https://pypi.org/project/tickrig/).

```console
pip install -e .[test]
tickrig emu $name --link /tmp/$name --control /tmp/$name.ctl
tickrig ctl /tmp/$name.ctl press button
pytest
```

`$module/device.py` is the machine: no clock, no I/O, one step a tick. `$module/device_type.py` says
how it is built, connected and shown.
"""

_DEVICE: Final = '''\
"""The machine: time and bytes in, bytes out; it reads no clock and does no I/O."""

from tickrig import (
    NEVER,
    Copyable,
    InputBank,
    InputSignal,
    LineSplitter,
    OutputSignal,
    SignalType,
)

INPUTS = (
    InputSignal("button", "a button: it says so when it is pressed", SignalType.BUTTON),
    InputSignal("no_power", "its supply is cut", SignalType.FAULT),
)
OUTPUTS = {
    "state": OutputSignal("state", "On or Off"),
    "lines": OutputSignal("lines", "lines heard since it was switched on"),
}


class $cls(Copyable):
    """Answers each line with the same line; says `pressed` when its button is pressed.

    Args:
        greeting: what it says when it is switched on.
    """

    tick_us = 1_000

    def __init__(self, greeting: str = "ready") -> None:
        self.inputs, self.outputs = InputBank(INPUTS), OUTPUTS
        self._greeting = greeting
        self.reset()

    @property
    def due_us(self) -> int:
        """When it has something to do without being spoken to: at once, or never."""
        dark = self.inputs["no_power"]
        return 0 if self.inputs.changed or not (self._greeted or dark) else NEVER

    def reset(self) -> None:
        """Be switched on: forget all but the inputs."""
        self._greeted, self._pressed, self._lines = False, 0, 0
        self._splitter = LineSplitter()

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        """Take what was heard since the last tick, and return what is sent in this one."""
        self.inputs.changed = False
        if self.inputs["no_power"]:
            self.reset()
            return b""
        said = [] if self._greeted else [self._greeting.encode()]
        if self.inputs["button"] > self._pressed:
            said.append(b"pressed")
        self._greeted, self._pressed = True, self.inputs["button"]
        heard = self._splitter.push(rx)
        self._lines += len(heard)
        return b"".join(line + b"\\n" for line in [*said, *heard])

    def read(self, name: str, /) -> int | str:
        """Return the present value of an output."""
        return {"state": "Off" if self.inputs["no_power"] else "On", "lines": self._lines}[name]
'''

_DEVICE_TYPE: Final = '''\
"""How tickrig builds, connects and shows it; the entry point in pyproject.toml names DEVICE."""

from collections.abc import Mapping
from typing import Any

from tickrig import DeviceField, DeviceType, LineSettings

from $module.device import $cls


def build(config: Mapping[str, Any]) -> $cls:
    """Make a device of the fields below, from a command line or a trace."""
    return $cls(**config)


DEVICE = DeviceType(
    name="$name",
    title="$cls",
    text="Emulate a $name on a pseudo-terminal.",
    build=build,
    fields=(DeviceField(name="greeting", default="ready", help="What it says first."),),
    line=LineSettings(baud=115_200),
)
'''

_TEST: Final = """\
from tickrig.testing import check_device, strategies

from $module.device import $cls
from $module.device_type import DEVICE


def test_it_keeps_what_every_device_keeps() -> None:
    check_device(DEVICE, traffic=strategies.chunks([b"hello\\n"]))


def test_it_greets_and_answers() -> None:
    device = $cls("hi")
    assert device.tick(0, b"") == b"hi\\n"
    assert device.tick(1_000, b"one\\ntw") == b"one\\n"
    assert device.tick(2_000, b"o\\n") == b"two\\n"


def test_it_says_once_that_its_button_is_pressed() -> None:
    device = $cls()
    device.inputs.set("button", 1)
    assert device.tick(0, b"") == b"ready\\npressed\\n"
    assert device.tick(1_000, b"") == b""
"""


def files(name: str, module: str) -> dict[str, str]:
    """Return the texts of a package by their paths in its folder.

    Args:
        name: what `tickrig emu` shall call the device.
        module: the same for Python.
    """
    words = {"name": name, "module": module, "cls": module.title().replace("_", "")}
    texts = {
        "pyproject.toml": _PYPROJECT,
        "README.md": _README,
        f"{module}/__init__.py": '"""An emulated $name, for tickrig."""\n',
        f"{module}/device.py": _DEVICE,
        f"{module}/device_type.py": _DEVICE_TYPE,
        f"tests/test_{module}.py": _TEST,
    }
    return {path: Template(text).substitute(words) for path, text in texts.items()}
