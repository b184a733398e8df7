"""docs/howto/openrtm.md: what it shows happens."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.environment import ROOT, Environment
from tests.host.rtc.engines.openrtm.extra import OMNIORB
from tests.host.rtc.engines.openrtm.live_system import CONTEXT, TOOL
from tests.host.rtc.engines.openrtm.name_server import eventually, free_port, program
from tests.page_runner import PageRunner

pytestmark = [OMNIORB, pytest.mark.realtime]

PAGE = ROOT / "docs" / "howto" / "openrtm.md"
TOOLS = "rtls rtact rtcat rtconf rtdis rtcon rtcryo rtstop rtteardown rtresurrect rtstart rtcheck"
PORT = "2809"


@dataclass(frozen=True)
class WithTools(Environment):
    """The environment of the tests, with the tools of rtshell and a name server on its path."""

    @property
    def variables(self) -> dict[str, str]:
        path = f"{self.folder / 'bin'}:{Path(sys.executable).parent}:/usr/bin:/bin"
        return {**os.environ, "PATH": path, "PYTHONPATH": str(ROOT / "src")}

    def make(self) -> None:
        """Write the tools."""
        (self.folder / "bin").mkdir()
        self._write("omniNames", f'exec {program()} "$@" -errlog /dev/null')
        for name in TOOLS.split():
            (self.folder / "bin" / f"{name}.py").write_text(TOOL.format(name), "utf-8")
            self._write(name, f'exec {sys.executable} {self.folder}/bin/{name}.py "$@"')

    def _write(self, name: str, line: str) -> None:
        file = self.folder / "bin" / name
        file.write_text(f"#!/bin/sh\n{line}\n", "utf-8")
        file.chmod(0o755)


class OpenRtmPage(PageRunner):
    """Runs the page with a name server on a port of its own; each command has to end with 0."""

    port = str(free_port())

    def _blocks(self, page: Path) -> list[tuple[str, str]]:
        blocks = super()._blocks(page)
        return [(language, text.replace(PORT, self.port)) for language, text in blocks]

    def _type(self, command: str, expected: str) -> None:
        if command.startswith("export AT="):
            return
        at = f"export AT=/localhost:{self.port}/{CONTEXT}; "
        end = "" if command.endswith("&") else " && echo ended with 0"
        more = f"{expected.strip()}...ended with 0" if end else expected
        super()._type(command if not end else f"{at}{command}{end}", more)

    def _start(self, command: str) -> None:
        process = subprocess.Popen(
            ["bash", "-c", f"exec {command}"],
            cwd=self.folder,
            env=self.environment.variables,
            stdin=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            text=True,
        )
        self._running.append(process)
        eventually(self._listens if "omniNames" in command else self._has_names, command)

    def _listens(self) -> bool:
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", int(self.port))) == 0

    def _has_names(self) -> bool:
        done = subprocess.run(
            ["rtls", f"/localhost:{self.port}/{CONTEXT}"],
            env=self.environment.variables,
            capture_output=True,
            text=True,
            check=False,
        )
        return "ConfigSample0.rtc" in done.stdout


def test_what_the_page_shows_happens(tmp_path: Path) -> None:
    environment = WithTools(tmp_path)
    environment.make()
    runner = OpenRtmPage(environment, tmp_path)
    runner.run(PAGE)
    used = {word for command in runner.typed for word in command.split()}
    assert used >= set(TOOLS.split())
