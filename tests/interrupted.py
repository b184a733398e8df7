"""Ctrl-C while a command loads: run in a process of its own by `test_commands`.

Reads lines `COUNT MODULE:FUNCTION COMMAND WORD...`; calls each in a child to which Ctrl-C comes
as it imports so many modules, or (`COUNTcb`) in so many callbacks of the importer, whose exceptions
Python drops. Writes a line of JSON: whether Ctrl-C came, its wait status, what it printed.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from importlib.machinery import ModuleSpec, PathFinder
from importlib.metadata import EntryPoint
from tempfile import TemporaryFile
from types import FrameType, ModuleType

CALLBACK = "cb"
"""`_get_module_lock.<locals>.cb` of the importer."""


class Interrupting:
    """Presses Ctrl-C when so many modules were looked for."""

    def __init__(self, count: int, pressed: int) -> None:
        self._left, self._pressed = count, pressed

    def find_spec(
        self, name: str, path: object = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        self.count()
        return None

    def profile(self, frame: FrameType, event: str, argument: object) -> None:
        if event == "call" and frame.f_code.co_name == CALLBACK:
            self.count()

    def count(self) -> None:
        self._left -= 1
        if self._left == 0:
            os.write(self._pressed, b"!")
            os.kill(os.getpid(), signal.SIGINT)


def call(pressed: int, count: str, point: str, command: str, *words: str) -> None:
    """Call a console script as its wrapper does, and end the process as Python does."""
    sys.argv = [command, *words]
    interrupting = Interrupting(int(count.removesuffix(CALLBACK)), pressed)
    if count.endswith(CALLBACK):
        sys.setprofile(interrupting.profile)
    else:
        sys.meta_path.insert(sys.meta_path.index(PathFinder), interrupting)
    EntryPoint(command, point, "console_scripts").load()()


if __name__ == "__main__":
    for line in sys.stdin.read().splitlines():
        with TemporaryFile() as said, TemporaryFile() as pressed:
            if (child := os.fork()) == 0:
                os.dup2(said.fileno(), 1)
                os.dup2(said.fileno(), 2)
                call(pressed.fileno(), *line.split())
                sys.exit()
            _, status = os.waitpid(child, 0)
            said.seek(0)
            code = os.waitstatus_to_exitcode(status)
            print(json.dumps([pressed.tell() > 0, code, said.read().decode()]))
            sys.stdout.flush()
