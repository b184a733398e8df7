"""`tickrig emu`: our command lines, and one made for the device type of another package."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.emulators.commands.cli import main
from tickrig.emulators.commands.device_type import DEVICES, DeviceType

MODULE = """\
import click

from tests.emulators.lamp import Lamp
from tickrig import DeviceType


class Bare:
    tick_us = due_us = 1_000


def build(config):
    if config.get("greeting") == "":
        raise ValueError("a lamp greets")
    if config.get("greeting") == "speed":
        return Lamp(speed=1)
    if config.get("greeting") == "bare":
        return Bare()
    return Lamp(config.get("greeting", "hi").encode() + b"\\n")


DEVICE = DeviceType(
    name="lamp",
    title="Lamp",
    text="Emulate a lamp.",
    build=build,
    options=(click.Option(["--greeting"], default="hi", help="What it says first."),),
)
"""
POINTS = (
    "[tickrig.devices]\nlamp = lamp_emu:DEVICE\nlight = lamp_emu:DEVICE\ndim = lamp_emu:build\n"
)
SCENARIO = "1ms send x\n2ms expect x within 10ms\n"


@pytest.fixture(autouse=True)
def _installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    info = tmp_path / "lamp_emu-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: lamp-emu\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(POINTS)
    (tmp_path / "lamp_emu.py").write_text(MODULE)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "lamp_emu", raising=False)
    monkeypatch.chdir(tmp_path)


def tickrig(*words: str, typed: str = "") -> Result:
    return CliRunner().invoke(main, words, input=typed)


def test_a_foreign_device_runs_a_scenario_is_traced_and_replayed() -> None:
    emu = ("emu", "lamp", "--greeting", "moin", "--scenario", "-", "--trace", "run.trace")
    run = tickrig(*emu, typed=SCENARIO)
    assert run.exit_code == 0, run.output
    assert "< moin" in run.stdout
    assert "expectations met: 1; missed: 0" in run.stderr
    assert tickrig("replay", "run.trace").output.startswith("identical: ")


def test_its_help_shows_its_own_options_and_those_of_all() -> None:
    said = tickrig("emu", "lamp", "--help").output
    assert "Emulate a lamp." in said
    assert "What it says first." in said
    assert "--scenario" in said
    assert "--panel" not in said


def test_what_cannot_be_built_is_one_line() -> None:
    run = tickrig("emu", "lamp", "--greeting", "", "--scenario", "-")
    assert (run.exit_code, run.stderr) == (2, "Error: a lamp greets\n")


def test_what_build_raises_otherwise_is_one_line_too() -> None:
    run = tickrig("emu", "lamp", "--greeting", "speed", "--scenario", "-")
    assert run.exit_code == 2
    told = "TypeError: Lamp.__init__() got an unexpected keyword argument 'speed'"
    assert run.stderr == f"Error: lamp cannot be built: {told}\n"


def test_so_is_what_is_no_device() -> None:
    run = tickrig("emu", "lamp", "--greeting", "bare", "--scenario", "-")
    assert run.exit_code == 2
    assert run.stderr == "Error: lamp: Bare has no reset, tick, inputs, outputs, read\n"


def test_broken_entry_points_are_a_line_each_and_break_nothing_else() -> None:
    said = tickrig("emu", "--help")
    assert said.exit_code == 0
    assert "lamp  " in said.stdout
    assert said.stderr.splitlines() == [
        "device 'light' of package lamp-emu (lamp_emu:DEVICE) calls itself 'lamp'",
        "device 'dim' of package lamp-emu (lamp_emu:build) is not a DeviceType",
    ]


OURS = "rrc, rtc-lite, rh3-base, urg, ucode-reader"


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("dim", "device 'dim' of package lamp-emu (lamp_emu:build) is not a DeviceType"),
        ("sofa", f"no device 'sofa'; known: {OURS}, canopen-slave, dim, lamp, light"),
    ],
)
def test_a_name_that_is_none_is_one_line(name: str, line: str) -> None:
    run = tickrig("emu", name)
    assert (run.exit_code, run.stderr) == (2, f"Error: {line}\n")


def test_our_commands_are_there_by_name() -> None:
    ours = tickrig("emu", "rrc", "--scenario", "-", typed="1ms send hello")
    assert ours.exit_code == 0, ours.output


@pytest.mark.parametrize("name", DEVICES.built_in)
def test_our_devices_are_device_types(name: str) -> None:
    device_type = DEVICES.load(name)
    assert isinstance(device_type, DeviceType)
    assert device_type.name == name
    assert device_type.build({}).tick_us > 0


def test_what_is_built_in_is_registered_as_others_register_theirs() -> None:
    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text("utf-8"))
    assert project["project"]["entry-points"]["tickrig.devices"] == DEVICES.built_in
