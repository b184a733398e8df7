"""docs/reference/canmon/canmon-net.md: what it shows happens."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.emulators.testing.conformance.test_page import ThisEnvironment
from tests.environment import ROOT
from tests.page_runner import PageRunner
from tickrig.host.canmon.cli import main
from tickrig.host.canmon.net.group import VERBS
from tickrig.host.cli.start import load

PAGE = ROOT / "docs" / "reference/canmon/canmon-net.md"


class Here(PageRunner):
    """Calls `canmon` in this process, which need not start for each of many commands."""

    def _type(self, command: str, expected: str) -> None:
        name, *words = shlex.split(command)
        if name != "canmon":
            super()._type(command, expected)
            return
        self.typed.append(command)
        result = CliRunner().invoke(main, words)
        said = result.stdout + result.stderr
        pattern = ".*".join(map(re.escape, expected.strip().split("...")))
        assert re.search(pattern, said, re.DOTALL), f"$ {command}\n{said}\n--- not:\n{expected}"


def test_what_the_page_shows_happens(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    runner = Here(ThisEnvironment(tmp_path), tmp_path)
    runner.run(PAGE)
    assert {command.split()[3] for command in runner.typed if "canmon net" in command} == set(VERBS)


def test_the_page_has_all_verbs() -> None:
    told = re.findall(r"^\| `([a-z]+)", PAGE.read_text("utf-8"), re.MULTILINE)
    assert set(VERBS) <= set(told)


def test_the_list_of_verbs_says_what_their_help_says() -> None:
    for path, short in VERBS.values():
        told = " ".join((load(path).help or "").split())
        assert told.startswith(short.removesuffix(".")), path
