"""`tickrig rtc edit` in a terminal, beside a system in another process."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.host.canmon.terminal import Terminal
from tests.host.rtc.canopen.bench import EXAMPLES

pytestmark = pytest.mark.realtime

PROGRAM = "from tickrig.emulators.commands.cli import main; main()"


@pytest.fixture
def system(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    words = ["rtc", "run", str(EXAMPLES / "rtc_chain.toml"), "--control", str(tmp_path / "ctl")]
    process = subprocess.Popen(
        [sys.executable, "-m", "tickrig", *words], stderr=subprocess.PIPE, text=True
    )
    assert process.stderr is not None
    assert "Ctrl-C ends" in process.stderr.readline()
    yield process
    process.kill()
    process.communicate()


def edit(tmp_path: Path, columns: int = 80, lines: int = 24) -> Terminal:
    words = "rtc", "edit", "--at", str(tmp_path / "ctl")
    terminal = Terminal(*words, columns=columns, lines=lines, program=PROGRAM)
    terminal.wait_for("3 components, 2 active")
    return terminal


@pytest.mark.parametrize("key", ["q", "\x03", "\x11"])
def test_it_changes_the_system_and_leaves_it_running(
    system: subprocess.Popen[str], tmp_path: Path, key: str
) -> None:
    terminal = edit(tmp_path)
    terminal.wait_for("├─┘")
    terminal.child.send("d")
    terminal.wait_for("3 components, 1 active")
    terminal.resize(120, 40)
    terminal.wait_for("Inactive, 100 Hz")
    terminal.child.send("a")
    terminal.wait_for("3 components, 2 active")
    terminal.child.send(key)
    assert terminal.end() == 0
    assert system.poll() is None


def test_a_signal_ends_it(system: subprocess.Popen[str], tmp_path: Path) -> None:
    terminal = edit(tmp_path)
    terminal.child.kill(15)
    assert terminal.end() == 0
    assert system.poll() is None


def test_a_system_that_is_killed_is_told(system: subprocess.Popen[str], tmp_path: Path) -> None:
    terminal = edit(tmp_path)
    system.kill()
    terminal.wait_for("the system is gone, waiting for it")
    terminal.child.send("d")
    terminal.wait_for("nothing was done")
    terminal.child.send("q")
    assert terminal.end() == 0
