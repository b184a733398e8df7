"""A command in a terminal, and what its screen shows."""

from __future__ import annotations

import os
import shlex
import sys
import termios
from collections.abc import Callable
from pathlib import Path

import pexpect
import pyte

PROGRAM = "from tickrig.host.canmon.cli import main; main()"
PATIENCE_S = 20.0
SLICE_S = 0.05


class Terminal:
    """`canmon` in a terminal of its own.

    Args:
        words: of the command line.
        columns: of the terminal.
        lines: of the terminal.
        feed: a file that a pipe brings to its standard input.
        program: what is run, `canmon` unless given.
    """

    def __init__(
        self,
        *words: str,
        columns: int = 100,
        lines: int = 30,
        feed: Path | None = None,
        program: str = PROGRAM,
    ) -> None:
        command = [sys.executable, "-c", program, *words]
        if feed is not None:
            command = ["/bin/sh", "-c", f"cat {feed} | {shlex.join(command)}"]
        env = {**os.environ, "TERM": "xterm-256color", "LANG": "C.UTF-8"}
        for name in ("COLUMNS", "LINES"):  # of the runner: they would go before the window's
            env.pop(name, None)
        self.child = pexpect.spawn(
            command[0],
            command[1:],
            dimensions=(lines, columns),
            env=env,
            encoding="utf-8",
        )
        self.modes = termios.tcgetattr(self.child.child_fd)
        self.written = ""
        self._screen = pyte.Screen(columns, lines)
        self._stream = pyte.Stream(self._screen)

    def text(self) -> str:
        """Return what the screen shows now."""
        return "\n".join(line.rstrip() for line in self._screen.display)

    def wait_for(self, text: str) -> None:
        """Wait until the screen shows a text."""
        for _ in range(int(PATIENCE_S / SLICE_S)):
            if text in self.text():
                return
            self._read()
        raise AssertionError(f"no {text!r} in\n{self.text()}")

    def wait_until(self, done: Callable[[], bool]) -> None:
        """Wait until something is done, and read meanwhile."""
        for _ in range(int(PATIENCE_S / SLICE_S)):
            if done():
                return
            self._read()
        raise AssertionError(self.written)

    def resize(self, columns: int, lines: int) -> None:
        """Give the window another size."""
        self._screen.resize(lines, columns)
        self.child.setwinsize(lines, columns)

    def end(self) -> int | None:
        """Wait for the end; return the exit status."""
        for _ in range(int(PATIENCE_S / SLICE_S)):
            if not self._read():
                break
        self.child.close()
        status: int | None = self.child.exitstatus
        return status

    def _read(self) -> bool:
        try:
            said = self.child.read_nonblocking(65_536, timeout=SLICE_S)
        except pexpect.TIMEOUT:
            return True
        except pexpect.EOF:
            return False
        self.written += said
        self._stream.feed(said)
        return True
