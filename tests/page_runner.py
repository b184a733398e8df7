"""Do what a page says, word for word: write its files, type its commands, compare what comes.

A block whose first line is `# NAME` is the file NAME. In a block of `console` a line with `$ ` is
typed in a shell, and what follows is what it prints; `...` stands for anything. A command of which
nothing is shown has to end well. What only installs tickrig is left out: the environment has it.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from tests.environment import Environment

BLOCK: Final = re.compile(r"^```(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)
FILE: Final = re.compile(r"# ([\w./-]+\.(?:py|toml|txt|csv|ini|yaml|robot))\n")
INSTALLING: Final = ("python3 -m venv", ". .venv", "pip install 'tickrig")
TIMEOUT_S: Final = 60


@dataclass
class PageRunner:
    """Runs a page in a folder.

    Attributes:
        environment: what the shell has.
        folder: where files are written; it stands for `/tmp` of the page too.
        typed: the commands, as they were typed.
    """

    environment: Environment
    folder: Path
    typed: list[str] = field(default_factory=list)
    _running: list[subprocess.Popen[str]] = field(default_factory=list)

    def run(self, page: Path) -> None:
        """Do all that a page says; AssertionError if something else comes of it."""
        try:
            for language, text in self._blocks(page):
                if not self._write(text) and language == "console":
                    self._type_all(text)
        finally:
            self.close()

    def write_files(self, page: Path) -> None:
        """Write the files of a page, and type nothing."""
        for _, text in self._blocks(page):
            self._write(text)

    def _blocks(self, page: Path) -> list[tuple[str, str]]:
        whole = page.read_text("utf-8").replace("/tmp/", f"{self.folder}/")
        return BLOCK.findall(whole)

    def _write(self, text: str) -> bool:
        """Write a block that is a file; say whether it is one."""
        if (name := FILE.match(text)) is None:
            return False
        path = self.folder / name[1]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text[name.end() :].lstrip("\n"), "utf-8")
        return True

    def close(self) -> None:
        """End what still runs."""
        for process in self._running:
            os.killpg(process.pid, signal.SIGINT)
            process.communicate(timeout=TIMEOUT_S)

    def _type_all(self, text: str) -> None:
        for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
            command, _, expected = part.partition("\n")
            while command.endswith("\\"):
                more, _, expected = expected.partition("\n")
                command = f"{command[:-1]} {more.removeprefix('> ')}"
            if not command.startswith(INSTALLING):
                self._type(command, expected)

    def _type(self, command: str, expected: str) -> None:
        self.typed.append(command)
        if command.endswith("&"):
            self._start(command[:-1])
            return
        done = subprocess.run(
            ["bash", "-c", command],
            cwd=self.folder,
            env=self.environment.variables,
            capture_output=True,
            text=True,
            check=False,
            timeout=TIMEOUT_S,
        )
        said = done.stdout + done.stderr
        assert expected.strip() or done.returncode == 0, f"$ {command}\n{said}"
        pattern = ".*".join(map(re.escape, expected.strip().split("...")))
        assert re.search(pattern, said, re.DOTALL), f"$ {command}\n{said}\n--- not:\n{expected}"

    def _start(self, command: str) -> None:
        """Start something that goes on, and wait for its first line."""
        process = subprocess.Popen(
            ["bash", "-c", f"exec {command}"],
            cwd=self.folder,
            env=self.environment.variables,
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        self._running.append(process)
        assert process.stdout is not None
        assert process.stdout.readline(), f"{command} says nothing"
