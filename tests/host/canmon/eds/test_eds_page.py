"""The commands of the page run, and the finding that it shows is found."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Final

import pytest
from click.testing import CliRunner

from tests.host.canmon.eds.test_eds_verbs import DEFECT
from tests.host.canopen.data_sheet.corpus import DRIVE, ROOT
from tests.wire.canopen.eds.xdd_text import XDD
from tickrig.host.canmon.cli import main

PAGE: Final = (ROOT / "docs" / "reference/canmon/eds.md").read_text("utf-8")
COMMANDS: Final = re.findall(r"^canmon (eds [^#\n]+)", PAGE, re.MULTILINE)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("drive.eds").write_text(DRIVE, "utf-8")
    Path("old.eds").write_text(DRIVE, "utf-8")
    Path("new.xdd").write_text(XDD, "utf-8")
    return tmp_path


def test_the_page_has_commands() -> None:
    assert {command.split()[1] for command in COMMANDS} == {"check", "fix", "diff", "show"}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_page_runs(command: str, folder: Path) -> None:
    words = [
        name
        for word in shlex.split(command)
        for name in (sorted(map(str, Path().glob(word))) if "*" in word else [word])
    ]
    result = CliRunner().invoke(main, words)
    assert result.exit_code in (0, 1), result.output


def test_the_finding_of_the_page_is_found(folder: Path) -> None:
    Path("drive.eds").write_text(DEFECT, "utf-8")
    (shown,) = re.findall(r"^drive\.eds:.*$", PAGE, re.MULTILINE)
    result = CliRunner().invoke(main, ["eds", "check", "drive.eds"])
    assert shown in result.stdout.splitlines()
