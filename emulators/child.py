"""An emulator in a process of its own, as a user would start it."""

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

START_S: Final = 10.0


@dataclass(frozen=True, slots=True)
class Child:
    """A running emulator.

    Attributes:
        process: the process; what it says comes out of its stderr.
        link: the terminal that it serves.
        control: its control socket.
    """

    process: subprocess.Popen[str]
    link: Path
    control: Path


@contextmanager
def running(module: str, *options: str) -> Iterator[Child]:
    """Run the emulator whose command is `main` of a module; end it on the way out.

    Raises:
        RuntimeError: it does not come up; the text is what it said.
    """
    with tempfile.TemporaryDirectory(prefix="tickrig-") as folder:
        link, control = Path(folder, "tty"), Path(folder, "control")
        program = f"from {module} import main; main()"
        paths = ["--link", str(link), "--control", str(control)]
        process = subprocess.Popen(
            [sys.executable, "-c", program, *paths, *options],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            _wait_until_up(process, link, control)
            yield Child(process, link, control)
        finally:
            process.terminate()
            process.communicate()


def _wait_until_up(process: subprocess.Popen[str], *paths: Path) -> None:
    deadline = time.monotonic() + START_S
    while not all(path.exists() for path in paths):
        if process.poll() is not None or time.monotonic() > deadline:
            process.kill()
            raise RuntimeError(f"the emulator did not start: {process.communicate()[1].strip()}")
        time.sleep(0.01)
