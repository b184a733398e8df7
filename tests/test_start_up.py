"""What commands import before they know what is asked of them: it is most of what they cost."""

from __future__ import annotations

import inspect
import json
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from tickrig.device.body import SIDES
from tickrig.emulators.canopen.choices import AUTO, BODIES, MODELS, PROFILES
from tickrig.emulators.canopen.eds import PROFILES as CANOPEN_PROFILES
from tickrig.emulators.canopen.models import MODELS as CANOPEN_MODELS
from tickrig.emulators.commands.cli import main as tickrig
from tickrig.emulators.rtc_lite.device_type import COMPONENTS
from tickrig.emulators.rtc_lite.fields import FIELDS as LITE_FIELDS
from tickrig.host.canmon.cli import main as canmon
from tickrig.host.cli.options import LazyCommand
from tickrig.host.cli.start import load

ROOT = Path(__file__).parents[1]
SCRIPTS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["scripts"]
SLOW = {"asyncio", "email", "http", "logging", "sqlite3", "subprocess", "tempfile", "xml"}

MOST = {
    "tickrig ctl /nowhere status": 21,
    "tickrig ctl /nowhere press power_button": 21,
    "tickrig TAB": 13,
    "tickrig campaign run --help": 16,
    "tickrig campaign TAB": 18,
    "tickrig check --help": 15,
    "tickrig init --help": 15,
    "tickrig run --help": 17,
    "tickrig ctl /nowhere TAB": 21,
    "tickrig demo fig120 -- TAB": 20,
    "tickrig replay TAB": 19,
    "tickrig compare TAB": 19,
    "tickrig record TAB": 22,
    "tickrig rtc ls": 29,
    "tickrig rtc con TAB": 29,
    "rrc-emu TAB": 15,
    "rrc TAB": 12,
    "rrc /nowhere TAB": 12,
    "rrc drive --help": 12,
    "rtc-lite-emu --framing TAB": 21,
    "rh3 goto TAB": 17,
    "rh3-emu TAB": 17,
    "urg-emu TAB": 15,
    "ucode-reader-emu TAB": 17,
    "ucode-resolver TAB": 17,
    "tkernel-emu TAB": 19,
    "canopen-slave-emu --model TAB": 19,
    "canmon TAB": 15,
    "canmon --help": 15,
    "rtc-canopen-builder TAB": 26,
}
"""Command lines, and how many modules of ours each may import."""

MOST_OF_A_BENCH = 165
"""How many modules of ours a bench with an RRC may import."""


@pytest.fixture(scope="module")
def imported() -> dict[str, list[str]]:
    """Return the modules that each command line imports beyond click."""
    process = subprocess.run(
        [sys.executable, ROOT / "tests" / "imported.py"],
        input="".join(f"{SCRIPTS[line.split()[0]]} {line}\n" for line in MOST),
        env={"XDG_RUNTIME_DIR": "/nowhere"},
        capture_output=True,
        text=True,
        check=True,
    )
    return dict(zip(MOST, map(json.loads, process.stdout.splitlines()), strict=True))


@pytest.mark.parametrize("line", MOST)
def test_a_command_imports_what_it_needs(imported: dict[str, list[str]], line: str) -> None:
    names = imported[line]
    packages = {name.partition(".")[0] for name in names}
    assert packages - sys.stdlib_module_names <= {"tickrig", "tickrig__mypyc", "click"}
    assert not packages & SLOW
    assert "tickrig ctl" not in line or "pathlib" not in packages
    ours = [name for name in names if name.startswith("tickrig.")]
    assert len(ours) <= MOST[line], ours


@pytest.mark.parametrize("group", [tickrig, canmon], ids=["tickrig", "canmon"])
def test_a_list_of_commands_says_what_their_help_says(group: click.Group) -> None:
    for awaited in group.commands.values():
        assert isinstance(awaited, LazyCommand)
        assert awaited.short_help is not None
        told = " ".join(load(awaited.path).help.split())
        assert told.startswith(awaited.short_help.removesuffix("."))


def commands_of(group: click.Group) -> Iterator[click.Command]:
    for command in group.commands.values():
        loaded = load(command.path) if isinstance(command, LazyCommand) else command
        yield from commands_of(loaded) if isinstance(loaded, click.Group) else (loaded,)


WORKED = [
    c for group in (tickrig, canmon) for c in commands_of(group) if hasattr(c.callback, "work")
]


@pytest.mark.parametrize("command", WORKED, ids=lambda command: str(command.name))
def test_the_work_of_a_command_takes_its_options(command: click.Command) -> None:
    work = load(vars(command.callback)["work"])
    inspect.signature(work).bind(**{str(parameter.name): None for parameter in command.params})


def test_what_can_be_named_is_what_there_is() -> None:
    assert tuple(CANOPEN_MODELS) == MODELS
    assert (AUTO, *CANOPEN_PROFILES) == PROFILES
    assert tuple(SIDES) == BODIES
    assert next(each.proposals for each in LITE_FIELDS if each.name == "node") == tuple(COMPONENTS)


def test_a_bench_without_nodes_imports_nothing_that_makes_them() -> None:
    code = (
        "import sys; from tickrig import Bench\n"
        "with Bench('rrc') as bench: bench.press('power_button'); bench.run_for('50ms')\n"
        "print(*(name for name in sys.modules if name.startswith('tickrig.')))"
    )
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    ours = process.stdout.split()
    assert len(ours) <= MOST_OF_A_BENCH, ours
    assert "tickrig.emulators.canopen.build" not in ours
