from __future__ import annotations

import re
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import pexpect
import pyte
import pytest

pytestmark = pytest.mark.realtime

PROGRAM = "from tickrig.emulators.rrc.cli import main; main()"
PATIENCE_S = 20.0


class Terminal:
    """`rrc-emu --panel` in a terminal of 80 x 24."""

    def __init__(self, folder: Path, *options: str) -> None:
        words = ["-c", PROGRAM, "--link", str(folder / "tty"), "--panel", *options]
        size, env = (24, 80), {"TERM": "xterm-256color", "LANG": "C.UTF-8"}
        self.child = pexpect.spawn(
            sys.executable, words, dimensions=size, env=env, encoding="utf-8"
        )
        self._screen = pyte.Screen(80, 24)
        self._stream = pyte.Stream(self._screen)

    def wait_for(self, text: str) -> None:
        for _ in range(int(PATIENCE_S / 0.1)):
            if text in "\n".join(self._screen.display):
                return
            try:
                self._stream.feed(self.child.read_nonblocking(65_536, timeout=0.1))
            except pexpect.TIMEOUT:
                continue
        raise AssertionError("\n".join(self._screen.display))

    def end(self) -> str:
        self.child.expect(pexpect.EOF, timeout=PATIENCE_S)
        self.child.close()
        return str(self.child.before)


def leave_by_key(terminal: Terminal) -> None:
    terminal.child.send("q")


def leave_by_signal(terminal: Terminal) -> None:
    terminal.child.kill(signal.SIGTERM)


@pytest.mark.parametrize("leave", [leave_by_key, leave_by_signal])
def test_the_panel_runs_an_emulator_and_leaves_nothing(
    leave: Callable[[Terminal], None], tmp_path: Path
) -> None:
    terminal = Terminal(tmp_path)
    terminal.wait_for("WaitPowerOn")
    terminal.child.send("p")
    terminal.wait_for("EV:PowerOnSuccess")
    (tmp_path / "tty").write_bytes(b"output1e00\n")
    terminal.wait_for("+30 %")
    leave(terminal)
    assert re.search(r"ran [\d.]+ s; late ticks: \d+.*; bytes lost: 0\r\n$", terminal.end())
    assert terminal.child.exitstatus == 0
    assert list(tmp_path.iterdir()) == []
