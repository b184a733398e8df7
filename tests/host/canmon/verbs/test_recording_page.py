"""The commands of the page run, on a log in place of a bus."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest
from click.testing import CliRunner

from tests.host.canmon.model.decode.drive_trace import GOLDEN
from tickrig.host.canmon.cli import main
from tickrig.host.canmon.model.logs.log_reader import read_log

PAGE: Final = (
    Path(__file__).parents[4] / "docs" / "reference/canmon/canmon-recording.md"
).read_text("utf-8")
COMMANDS: Final = re.findall(r"^canmon (dump can0 .*?[^&])(?:  .*)?$", PAGE, re.MULTILINE)


def test_the_page_has_commands() -> None:
    assert len(COMMANDS) == 7


SCRIPT: Final = re.compile(r"^(canmon dump can0 -l run.log &\n.*?)^```", re.MULTILINE | re.DOTALL)
FRAME: Final = "(0000000001.000000) can0 705#7F\n"
CALL: Final = "from tickrig.commands import canmon; canmon()"


@pytest.mark.realtime
@pytest.mark.skipif(sys.platform == "win32", reason="no bash")
@pytest.mark.parametrize("number", ["TERM", "INT"])
def test_a_script_ends_a_recording(tmp_path: Path, number: str) -> None:
    command = tmp_path / "canmon"
    command.write_text(f"#!/bin/sh\nexec {shlex.quote(sys.executable)} -c '{CALL}' \"$@\"\n")
    command.chmod(0o755)
    (script,) = SCRIPT.findall(PAGE)
    script = script.replace("canmon dump can0 -l run.log &", "./canmon dump - -l run.log <fifo &")
    feed = f"exec 3>fifo; printf '{FRAME}' >&3; until [ -s run.log ]; do :; done"
    script = script.replace("# what is to be recorded", feed)
    script = script.replace("kill $recorder", f"kill -{number} $recorder")
    words = ["bash", "-c", f"mkfifo fifo\n{script}"]
    result = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "")
    assert (tmp_path / "run.log").read_text("ascii") == FRAME


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
