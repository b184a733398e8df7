"""`tickrig new device`; that what it writes runs is in `tests/test_stranger.py`."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
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


def run_tests(folder: str, *words: str) -> subprocess.CompletedProcess[str]:
    """Run the tests of a package that is not installed."""
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([".", str(ROOT / "src")])},
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_binary_device_is_green_when_it_is_made() -> None:
    made = new("my-gadget", "--binary")
    assert Path("my-gadget/my_gadget/frames.py") in map(Path, made.stdout.splitlines())
    done = run_tests("my-gadget")
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    assert "passed" in done.stdout


@pytest.mark.parametrize("kind", [(), ("--binary",)])
def test_what_is_made_follows_the_rules_of_style(kind: tuple[str, ...]) -> None:
    rules = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["ruff"]
    new("my-lamp", *kind)
    for verb in (
        [
            "check",
            f"--select={','.join(rules['lint']['select'])}",
            f"--ignore={','.join(rules['lint']['ignore'])}",
            "--per-file-ignores=tests/**:D",
            "--config=lint.pydocstyle.convention='google'",
            "--output-format=concise",
        ],
        ["format", "--check"],
    ):
        words = ["ruff", *verb, "--isolated", f"--line-length={rules['line-length']}", "."]
        done = subprocess.run(words, cwd="my-lamp", capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr


FAILS = """
import pytest

from gadget.device_type import DEVICE
from gadget.frames import Command, encode


@pytest.fixture
def bench_config():
    return DEVICE


def test_fails(bench):
    port = bench.serial(timeout=0.05)
    port.write(encode(Command.READ, 0))
    assert port.read(8) == b""
"""


def test_a_failure_and_the_page_of_a_report_show_frames_by_field() -> None:
    new("gadget", "--binary")
    Path("gadget/tests/test_fails.py").write_text(FAILS)
    done = run_tests("gadget", "tests/test_fails.py", "--bench-report", "page.html")
    assert "gadget > command=READ address=0\n" in done.stdout
    assert "gadget < command=READ_ANSWER address=0 value=4660\n" in done.stdout
    assert "command=READ_ANSWER address=0 value=4660" in Path("gadget/page.html").read_text("utf-8")


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
