"""`tickrig new device`; that what it writes runs is in `tests/test_stranger.py`."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.emulators.commands.cli import main

ROOT = Path(__file__).parents[3]


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def new(*words: str) -> Result:
    return CliRunner().invoke(main, ("new", "device", *words))


def test_it_names_the_files_that_it_wrote() -> None:
    made = new("my-lamp")
    assert made.exit_code == 0
    paths = [Path(line) for line in made.stdout.splitlines()]
    assert all(path.is_file() for path in paths)
    assert Path("my-lamp/my_lamp/device.py") in paths
    assert "class MyLamp(" in Path("my-lamp/my_lamp/device.py").read_text("utf-8")
    assert not any("$" in path.read_text("utf-8") for path in paths)


def test_a_binary_device_is_green_when_it_is_made() -> None:
    made = new("my-gadget", "--binary")
    assert Path("my-gadget/my_gadget/frames.py") in map(Path, made.stdout.splitlines())
    path = os.pathsep.join([".", str(ROOT / "src")])
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"],
        cwd="my-gadget",
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert "passed" in done.stdout


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["My"], "'My' is no name: a small letter, then small letters, digits and -, as my-lamp"),
        (["2nd"], "'2nd' is no name: a small letter, then small letters, digits and -, as my-lamp"),
        (
            ["../x"],
            "'../x' is no name: a small letter, then small letters, digits and -, as my-lamp",
        ),
        (["class"], "'class' is a word of Python, and no module: take another, as my-class"),
        (["json"], "'json' is the name of a module that is there already"),
        (["click"], "'click' is the name of a module that is there already"),
        (["rtc-lite"], "there is a device 'rtc-lite' already: tickrig emu rtc-lite"),
        (["lamp", "--in", "/nowhere"], "folder /nowhere/lamp: No such file or directory"),
    ],
)
def test_a_bad_name_or_place_is_one_line(words: list[str], line: str) -> None:
    refused = new(*words)
    assert (refused.exit_code, refused.stderr) == (2, f"Error: {line}\n")


def test_a_folder_that_is_there_is_left_alone() -> None:
    Path("lamp").mkdir()
    refused = new("lamp")
    assert (refused.exit_code, refused.stderr) == (2, "Error: folder lamp: File exists\n")
    assert not any(Path("lamp").iterdir())
