"""An emulator in a separate process, as a user would start it."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_START_S: Final = 60.0
"""Time-out for the start of an emulator on a busy machine. The end of its process is detected at
once."""


@dataclass(frozen=True, slots=True)
class Child:
    """An emulator that runs in a process of its own, with the paths of its files.

    Attributes:
        process: the process.
        link: terminal that the emulator serves, if any.
        control: control socket of the emulator.
        log: file with the output of the emulator up to now.
    """

    process: subprocess.Popen[bytes]
    link: Path
    control: Path
    log: Path


class _ChildError(RuntimeError):
    """An emulator does not start.

    Attributes:
        status: exit status of the emulator, or 1 if it did not end.
    """

    def __init__(self, text: str, status: int | None) -> None:
        super().__init__(text)
        self.status = 1 if status is None else status


@contextmanager
def running(module: str, *options: str, linked: bool = True) -> Iterator[Child]:
    """Run an emulator in a process of its own, and end it when the context is left.

    Args:
        module: module whose function `main` is the command of the emulator.
        options: options of the command, except `--link` and `--control`.
        linked: whether the command has an option `--link` for a terminal.

    Raises:
        _ChildError: the emulator does not start. The message is the last line of the emulator's
            output.
    """
    with tempfile.TemporaryDirectory(prefix="tickrig-") as name:
        link, control, log = (Path(name, part) for part in ("tty", "control", "log"))
        program = f"from {module} import main; main()"
        paths = [*(["--link", str(link)] if linked else []), "--control", str(control)]
        command = [sys.executable, "-c", program, *paths, *options]
        with log.open("wb") as said:
            process = subprocess.Popen(command, stdout=said, stderr=said)
        try:
            child = Child(process, link, control, log)
            _wait_until_up(child, [link, control] if linked else [control])
            yield child
        finally:
            process.terminate()
            process.wait()


def _wait_until_up(child: Child, paths: list[Path]) -> None:
    deadline = time.monotonic() + _START_S
    while not all(path.exists() for path in paths):
        if child.process.poll() is not None or time.monotonic() > deadline:
            said = child.log.read_text("utf-8", "replace").split("\n")
            last = next((line for line in reversed(said) if line), "it said nothing")
            text = f"the emulator did not start: {last.removeprefix('Error: ')}"
            raise _ChildError(text, child.process.poll())
        time.sleep(0.01)
