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
@click.option("--binary", is_flag=True, help="Frames with a length and a CRC instead of lines.")
def device(name: str, folder: Path, binary: bool) -> None:
    """Write the package of a device on a serial line into a new folder NAME.

    It runs at once, and is yours to change:

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


# What `--binary` writes instead: a device that answers requests in frames with a length and a CRC.

_FRAMES: Final = '''\
"""The protocol: frames of 55h, a length, a command, data and a CRC-16."""

from enum import IntEnum
from struct import calcsize, pack, unpack
from typing import Any

import crcmod

from tickrig import by_length

_HEADER = 0x55
_ENDS = 4  # bytes that the length does not count: header, length, CRC
_crc16 = crcmod.mkCrcFun(0x1_8005, initCrc=0xFFFF, rev=True, xorOut=0)


class Command(IntEnum):
    """What a frame is; an answer has the highest bit set."""

    READ = 0x01
    WRITE = 0x02
    READ_ANSWER = 0x81
    WRITE_ANSWER = 0x82
    REFUSED = 0xFF


_LAYOUTS = {
    Command.READ: ("<B", ("address",)),
    Command.WRITE: ("<BH", ("address", "value")),
    Command.READ_ANSWER: ("<BH", ("address", "value")),
    Command.WRITE_ANSWER: ("<BH", ("address", "value")),
    Command.REFUSED: ("<B", ("command_code",)),
}


def encode(command: Command, *values: int) -> bytes:
    """Write a frame."""
    layout, _ = _LAYOUTS[command]
    body = bytes([command]) + pack(layout, *values)
    head = bytes([_HEADER, len(body)]) + body
    return head + pack("<H", _crc16(head))


def parse(frame: bytes) -> dict[str, Any]:
    """Return the fields of a frame by name; ValueError if it is none."""
    if len(frame) <= _ENDS or frame[0] != _HEADER or frame[1] != len(frame) - _ENDS:
        raise ValueError("no frame")
    if pack("<H", _crc16(frame[:-2])) != frame[-2:]:
        raise ValueError("wrong CRC")
    command, data = Command(frame[2]), frame[3:-2]
    layout, names = _LAYOUTS[command]
    if len(data) != calcsize(layout):
        raise ValueError(f"{command.name} has {len(data)} bytes of data")
    return {"command": command, **dict(zip(names, unpack(layout, data), strict=True))}


FRAMES = by_length(bytes([_HEADER]), at=1, extra=_ENDS, gap="20ms").described(parse)
"""Where frames end on the line, and how transcripts and reports show them."""
'''

_BINARY_DEVICE: Final = '''\
"""The machine: time and bytes in, bytes out; it reads no clock and does no I/O."""

from tickrig import Copyable, InputBank, InputSignal, OutputSignal, SignalType

from $module.frames import FRAMES, Command, encode, parse

INPUTS = (
    InputSignal("button", "a button: it is counted", SignalType.BUTTON),
    InputSignal("no_power", "its supply is cut", SignalType.FAULT),
)
OUTPUTS = {
    "state": OutputSignal("state", "On or Off"),
    "level": OutputSignal("level", "what register 1 holds"),
    "errors": OutputSignal("errors", "pieces heard that are no request"),
}

SERIAL, LEVEL, PRESSES = 0, 1, 2
"""Registers; only the level can be written."""


class $cls(Copyable):
    """Answers a request to read or write a register; ignores what is no request, as most do.

    Args:
        serial: what register 0 holds.
    """

    tick_us = 1_000

    def __init__(self, serial: int = 0x1234) -> None:
        self.inputs, self.outputs = InputBank(INPUTS), OUTPUTS
        self._serial = serial
        self.reset()

    @property
    def due_us(self) -> int:
        """When it has something to do without being spoken to: a silence that ends a frame."""
        return 0 if self.inputs.changed else self._splitter.due_us

    def reset(self) -> None:
        """Be switched on: forget all but the inputs."""
        self._splitter = FRAMES.splitter()
        self._level, self._errors = 0, 0

    def tick(self, now_us: int, rx: bytes, /) -> bytes:
        """Take what was heard since the last tick, and return what is sent in this one."""
        self.inputs.changed = False
        if self.inputs["no_power"]:
            self.reset()
            return b""
        return b"".join([self._answer(frame) for frame in self._splitter.push(now_us, rx)])

    def _answer(self, frame: bytes) -> bytes:
        try:
            request = parse(frame)
        except ValueError:
            self._errors += 1
            return b""
        command, address = request["command"], request.get("address", 0)
        if command is Command.READ and address in (SERIAL, LEVEL, PRESSES):
            return encode(Command.READ_ANSWER, address, self._register(address))
        if command is Command.WRITE and address == LEVEL:
            self._level = request["value"]
            return encode(Command.WRITE_ANSWER, address, self._level)
        return encode(Command.REFUSED, command)

    def _register(self, address: int) -> int:
        return (self._serial, self._level, self.inputs["button"] & 0xFFFF)[address]

    def read(self, name: str, /) -> int | str:
        """Return the present value of an output."""
        if name == "state":
            return "Off" if self.inputs["no_power"] else "On"
        return {"level": self._level, "errors": self._errors}[name]
'''

_BINARY_DEVICE_TYPE: Final = '''\
"""How tickrig builds, connects and shows it; the entry point in pyproject.toml names DEVICE."""

from collections.abc import Mapping
from typing import Any

from tickrig import DeviceField, DeviceType, LineSettings

from $module.device import $cls
from $module.frames import FRAMES


def build(config: Mapping[str, Any]) -> $cls:
    """Make a device of the fields below, from a command line or a trace."""
    return $cls(**config)


DEVICE = DeviceType(
    name="$name",
    title="$cls",
    text="Emulate a $name on a pseudo-terminal.",
    build=build,
    fields=(
        DeviceField(
            name="serial", kind=int, low=0, high=65_535, default=0x1234, help="Serial number."
        ),
    ),
    line=LineSettings(baud=115_200, splitter=FRAMES),
)
'''

_BINARY_TEST: Final = '''\
import pytest
from tickrig import Bench
from tickrig.testing import check_device, strategies

from $module.device import LEVEL, PRESSES, SERIAL, $cls
from $module.device_type import DEVICE
from $module.frames import Command, encode, parse

READ_LEVEL = encode(Command.READ, LEVEL)
WRITE_LEVEL = encode(Command.WRITE, LEVEL, 40)


def test_it_keeps_what_every_device_keeps() -> None:
    check_device(DEVICE, traffic=strategies.chunks([READ_LEVEL, WRITE_LEVEL]), pauses=False)


def test_it_answers_requests() -> None:
    device = $cls(serial=7)
    assert parse(device.tick(0, encode(Command.READ, SERIAL)))["value"] == 7
    assert device.tick(1_000, WRITE_LEVEL[:3]) == b""
    assert device.tick(2_000, WRITE_LEVEL[3:]) == encode(Command.WRITE_ANSWER, LEVEL, 40)
    assert device.tick(3_000, READ_LEVEL) == encode(Command.READ_ANSWER, LEVEL, 40)
    assert device.tick(4_000, encode(Command.WRITE, SERIAL, 1)) == encode(Command.REFUSED, 2)


def test_it_ignores_a_wrong_crc_and_counts_it() -> None:
    device = $cls()
    assert device.tick(0, READ_LEVEL[:-1] + b"\\0") == b""
    assert device.read("errors") == 1


def test_it_forgets_half_a_frame_after_a_silence() -> None:
    device = $cls()
    assert device.tick(0, READ_LEVEL[:2]) == b""
    assert device.tick(20_000, b"") == b""
    assert device.tick(21_000, READ_LEVEL) == encode(Command.READ_ANSWER, LEVEL, 0)


def ask(port, request: bytes, size: int) -> bytes:
    """Ask as a host with pyserial."""
    port.reset_input_buffer()
    port.write(request)
    return port.read(size)


def test_a_host_reads_a_register_and_the_transcript_says_so() -> None:
    with Bench(DEVICE) as bench:
        port = bench.serial(timeout=0.1)
        bench.press("button")
        answer = parse(ask(port, encode(Command.READ, PRESSES), size=8))
        assert answer["value"] == 1
        assert "> command=READ address=2" in bench.transcript()
        assert "< command=READ_ANSWER address=2 value=1" in bench.transcript()


@pytest.mark.parametrize("fault", ["garbage", "truncate", "parity", "split=200ms", "delay=200ms"])
def test_a_host_that_checks_its_answers_finds_a_fault_of_the_line(fault: str) -> None:
    with Bench(DEVICE) as bench:
        port = bench.serial(timeout=0.1)
        bench.fault(fault)
        with pytest.raises(ValueError):
            parse(ask(port, READ_LEVEL, size=8))
'''

_BINARY_FUZZ_TEST: Final = '''\
"""Whatever it hears, it does not raise, and it answers again afterwards."""

from random import Random

from tickrig.testing import fuzz_one_input

from $module.device import SERIAL
from $module.device_type import DEVICE
from $module.frames import Command, encode

one_input = fuzz_one_input(
    DEVICE,
    words=[encode(Command.READ, 1), encode(Command.WRITE, 1, 40)],
    request=[encode(Command.READ, SERIAL)],
    answer=encode(Command.READ_ANSWER, SERIAL, 0x1234),
)


def test_no_bytes_make_it_raise_or_fall_silent() -> None:
    for seed in range(100):
        one_input(Random(seed).randbytes(60))
'''


def files(name: str, module: str, *, binary: bool = False) -> dict[str, str]:
    """Return the texts of a package by their paths in its folder.

    Args:
        name: what `tickrig emu` shall call the device.
        module: the same for Python.
        binary: whether it speaks in frames, not in lines.
    """
    words = {"name": name, "module": module, "cls": module.title().replace("_", "")}
    texts = {
        "pyproject.toml": _PYPROJECT,
        "README.md": _README,
        f"{module}/__init__.py": '"""An emulated $name, for tickrig."""\n',
        f"{module}/device.py": _BINARY_DEVICE if binary else _DEVICE,
        f"{module}/device_type.py": _BINARY_DEVICE_TYPE if binary else _DEVICE_TYPE,
        f"tests/test_{module}.py": _BINARY_TEST if binary else _TEST,
    }
    if binary:
        texts[f"{module}/frames.py"] = _FRAMES
        texts[f"tests/test_{module}_fuzz.py"] = _BINARY_FUZZ_TEST
    return {path: Template(text).substitute(words) for path, text in texts.items()}
