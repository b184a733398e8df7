"""The commands of the cheat sheets: those on files run, in order; others have these options."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from tickrig.emulators.commands.cli import main as tickrig
from tickrig.host.canmon.cli import main as canmon

ROOT = Path(__file__).parents[1]
SHEETS = sorted(
    {*(ROOT / "docs/reference/cheat-sheets").glob("*.md")}
    - {ROOT / "docs/reference/cheat-sheets/index.md"}
)
FILES = {
    "run.log": "tests/golden/canmon/drive.log",
    "drive.eds": "examples/eds/epos.eds",
    "rig.toml": "examples/chair/rig.toml",
    "test_chair.py": "examples/chair/test_chair.py",
    "beego.toml": "examples/rigs/beego.toml",
}
ELSEWHERE = re.compile(
    r"\bv?can0\b|ttyUSB0|real\.trace|hardware\.toml|--link|--control|--bench-mode|\.ctl\b"
)
"""What a command has that needs a bus, a port or a running emulator."""
FINDS = {"canmon check", "canmon conform", "canmon eds"}
"""Commands that end with 1 if they find something."""
GROUPS: dict[str, click.Command] = {"canmon": canmon, "tickrig": tickrig}
MOST_LINES = 62
"""Of a sheet, so that it is one printed page."""


def commands(sheet: Path) -> list[list[str]]:
    """Return the commands of a sheet, as words."""
    lines = re.findall(r"^\$ (.*)$", sheet.read_text("utf-8"), re.MULTILINE)
    return [shlex.split(line, comments=True) for line in lines]


def run(words: list[str]) -> tuple[int, str, str]:
    """Run a command in this process where that is possible: each start-up takes a second."""
    program, *rest = words
    if program in GROUPS:
        result = CliRunner().invoke(GROUPS[program], rest)
        return result.exit_code, result.stdout, result.stderr
    script = Path(sys.executable).with_name(program)
    done = subprocess.run(
        [sys.executable, script, *rest], capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("sheet", SHEETS, ids=[sheet.stem for sheet in SHEETS])
def test_the_commands_of_a_sheet_work(
    sheet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, source in FILES.items():
        shutil.copy(ROOT / source, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    found = commands(sheet)
    assert len(found) > 10
    for words in found:
        if ELSEWHERE.search(shlex.join(words)):
            continue
        status, output, errors = run(words)
        allowed = (0, 1) if " ".join(words[:2]) in FINDS else (0,)
        assert status in allowed, (shlex.join(words), output, errors)


@pytest.mark.parametrize("sheet", SHEETS, ids=[sheet.stem for sheet in SHEETS])
def test_the_other_commands_have_these_options(sheet: Path) -> None:
    for words in commands(sheet):
        if words[0] == "pytest" or not ELSEWHERE.search(shlex.join(words)):
            continue
        verb = words[1:3] if words[1] == "emu" else words[1:2]
        if words[0] == "canopen-slave-emu":
            verb = []
        if words[1] == "net":
            verb = ["net", "can0", words[3]]
        status, output, errors = run([words[0], *verb, "--help"])
        assert status == 0, (words, errors)
        options = [word for word in words[1:] if re.match(r"--?[a-z]", word)]
        assert [one for one in options if one not in output] == [], words


@pytest.mark.parametrize("sheet", SHEETS, ids=[sheet.stem for sheet in SHEETS])
def test_a_sheet_is_one_page(sheet: Path) -> None:
    assert len(sheet.read_text("utf-8").splitlines()) <= MOST_LINES
