"""The commands of the page run, on a log in place of a bus."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path
from typing import Final

import pytest
from click.testing import CliRunner

from tests.host.monitor.decode.drive_trace import GOLDEN
from tickrig.host.canmon.cli import main
from tickrig.host.monitor.logs.log_reader import read_log

PAGE: Final = (Path(__file__).parents[4] / "docs" / "canmon-recording.md").read_text("utf-8")
COMMANDS: Final = re.findall(r"^canmon (dump can0 .*?)(?:  .*)?$", PAGE, re.MULTILINE)


def test_the_page_has_commands() -> None:
    assert len(COMMANDS) == 7


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_page_runs(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(GOLDEN / "drive.log", "in.log")
    Path("rules.toml").write_text("no_emcy = true\n")
    words = ["in.log" if word == "can0" else word for word in shlex.split(command)]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.output
    here = [path for path in tmp_path.iterdir() if re.fullmatch(r"run.*\.(log|gz|blf)", path.name)]
    waits = "fault.log" in command
    frames = sum(len(list(read_log(path))) for path in here)
    assert waits or frames == len(list(read_log(Path("in.log"))))
    assert Path("fault.index.jsonl").exists() is waits
