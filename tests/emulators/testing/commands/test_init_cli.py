from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from tickrig.emulators.canopen.choices import MODELS
from tickrig.emulators.commands.cli import main
from tickrig.emulators.commands.device_type import DEVICES
from tickrig.emulators.testing.commands import rig_template
from tickrig.emulators.testing.commands.init_cli import init
from tickrig.emulators.testing.rig_file.reader import read_rig_file

ROOT = Path(__file__).parents[4]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copy(ROOT / "examples" / "io_module.eds", tmp_path)
    shutil.copy(ROOT / "examples" / "device_rtc_gripper.py", tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*words: str) -> tuple[int, str]:
    result = CliRunner().invoke(init, words)
    return result.exit_code, result.stdout or result.stderr


def test_without_words_it_is_an_rrc(folder: Path) -> None:
    assert run() == (0, "rig.toml\n")
    plan = read_rig_file(folder / "rig.toml")
    assert [(each.name, each.type) for each in plan.devices.values()] == [("rrc", "rrc")]


EVERY = [*DEVICES.built_in, *MODELS, "io_module.eds", "device_rtc_gripper.py:Gripper"]


@pytest.mark.parametrize("types", [[each] for each in EVERY] + [EVERY * 2], ids=str)
def test_what_it_writes_checks_with_and_without_its_proposals(
    types: list[str], folder: Path
) -> None:
    status, out = run(*(word for each in types for word in ("--device", each)))
    assert (status, out) == (0, "rig.toml\n")
    assert len(read_rig_file(folder / "rig.toml").devices) == len(types)
    text = (folder / "rig.toml").read_text("utf-8")
    proposed = re.sub(r"^# (?=\S+ = |\[)", "", text, flags=re.MULTILINE)
    (folder / "all.toml").write_text(proposed, "utf-8")
    plan = read_rig_file(folder / "all.toml")
    assert len(plan.faults) == len(types)
    assert plan.hardware is not None
    assert any(device.start for device in plan.devices.values())


def test_two_blanks_stand_before_each_comment(folder: Path) -> None:
    shutil.copy(folder / "io_module.eds", folder / "input_and_output_module.eds")
    types = [*EVERY, "input_and_output_module.eds", "motor-core-unit"]
    run(*(word for each in types for word in ("--device", each)))
    lines = (folder / "rig.toml").read_text("utf-8").splitlines()
    close = [line for line in lines if re.match(r"(# )?(\S+ = |\[)[^#]*(?<!  )#", line)]
    assert close == []


def test_a_device_with_one_output_has_no_empty_comment() -> None:
    assert rig_template._beside("# lamp.level = 0", "") == "# lamp.level = 0"


def test_a_file_that_is_there_is_left_alone(folder: Path) -> None:
    (folder / "rig.toml").write_text("mine")
    told = "file rig.toml is there already, and is left alone: -o FILE writes another one"
    assert run() == (2, f"Error: {told}\n")
    assert (folder / "rig.toml").read_text() == "mine"


def test_it_says_what_to_do_next(folder: Path) -> None:
    result = CliRunner().invoke(init, ["-o", "my rig.toml"])
    assert (result.exit_code, result.stdout) == (0, "my rig.toml\n")
    edit, *commands = result.stderr.strip().split("; ")
    assert (edit, commands[1]) == ("next: edit it", "tickrig run 'my rig.toml'")
    assert CliRunner().invoke(main, shlex.split(commands[0])[1:]).exit_code == 0


@pytest.mark.parametrize(
    ("file", "told"),
    [
        ("no/rig.toml", "file no/rig.toml: no directory no"),
        ("io_module.eds/rig.toml", "file io_module.eds/rig.toml: Not a directory"),
        ("/proc/self/cmdline/x", "file /proc/self/cmdline/x: Not a directory"),
        ("/proc/rig.toml", "file /proc/rig.toml: cannot be made there"),
    ],
)
def test_where_nothing_can_be_written_is_told(file: str, told: str) -> None:
    assert run("-o", file) == (2, f"Error: {told}\n")


def test_standard_output_is_a_file_too(folder: Path) -> None:
    status, out = run("--device", "epos", "-o", "-")
    assert (status, "[device.epos]" in out) == (0, True)
    assert not (folder / "rig.toml").exists()


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ("eops", "--device no device 'eops'; did you mean 'epos'?"),
        ("nowhere.eds", "--device nowhere.eds: file nowhere.eds: No such file"),
        ("nowhere.py:A", "--device nowhere.py:A: nowhere.py: No such file"),
    ],
)
def test_what_cannot_be_made_is_told_and_nothing_written(
    given: str, complaint: str, folder: Path
) -> None:
    status, out = run("--device", given)
    assert (status, complaint in out) == (2, True)
    assert not (folder / "rig.toml").exists()


def test_types_are_completed() -> None:
    (option, *_) = init.params
    with click.Context(init) as context:
        found = [item.value for item in option.shell_complete(context, "r")]
    assert found == ["rrc", "rtc-lite", "rh3-base", "rtc-echo"]
