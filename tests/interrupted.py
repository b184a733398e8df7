"""Ctrl-C while a command loads: run in a process of its own by `test_commands`.

Reads lines `COUNT MODULE:FUNCTION COMMAND WORD...`; calls each in a child to which Ctrl-C comes
as it imports so many modules, and writes a line of JSON: its wait status, what it printed.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from importlib.machinery import ModuleSpec, PathFinder
from importlib.metadata import EntryPoint
from tempfile import TemporaryFile
from types import ModuleType


class Interrupting:
    """Presses Ctrl-C when so many modules were looked for."""

    def __init__(self, count: int) -> None:
        self._left = count

    def find_spec(
        self, name: str, path: object = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        self._left -= 1
        if self._left == 0:
            os.kill(os.getpid(), signal.SIGINT)
        return None


def call(count: str, point: str, command: str, *words: str) -> None:
    """Call a console script as its wrapper does, and end the process as Python does."""
    sys.argv = [command, *words]
    sys.meta_path.insert(sys.meta_path.index(PathFinder), Interrupting(int(count)))
    EntryPoint(command, point, "console_scripts").load()()


if __name__ == "__main__":
    for line in sys.stdin.read().splitlines():
        with TemporaryFile() as said:
            if (child := os.fork()) == 0:
                os.dup2(said.fileno(), 1)
                os.dup2(said.fileno(), 2)
                call(*line.split())
                sys.exit()
            _, status = os.waitpid(child, 0)
            said.seek(0)
            print(json.dumps([os.waitstatus_to_exitcode(status), said.read().decode()]))
            sys.stdout.flush()
