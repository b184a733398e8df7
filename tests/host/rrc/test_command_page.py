"""The page on `rrc`: what it says is what happens."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from tests.environment import ROOT, Environment
from tests.page_runner import PageRunner
from tickrig.host.rrc.cli import main

PAGE = ROOT / "docs" / "reference" / "devices" / "rrc-command.md"
COMMANDS = ("rrc", "rrc-emu", "tickrig")


class Here(Environment):
    """This environment, with the commands of the tree."""

    @property
    def variables(self) -> dict[str, str]:
        return {**super().variables, "PYTHONPATH": str(ROOT / "src"), "PYTHONUNBUFFERED": "1"}


@pytest.mark.realtime
def test_its_commands_do_what_it_says(tmp_path: Path) -> None:
    for folder in ("bin", "work"):
        (tmp_path / folder).mkdir()
    for name in COMMANDS:
        point = name.replace("-", "_")
        program = f"from tickrig.commands import {point}; {point}()"
        script = tmp_path / "bin" / name
        script.write_text(f"#!/bin/sh\nexec {sys.executable} -c '{program}' \"$@\"\n")
        script.chmod(0o755)
    runner = PageRunner(Here(tmp_path), tmp_path / "work")
    runner.run(PAGE)
    assert len(runner.typed) == 12


def test_it_has_each_verb_and_each_named_test() -> None:
    text = PAGE.read_text("utf-8")
    assert [
        name for name in main.commands if not re.search(rf"^\| `{name}\b", text, re.MULTILINE)
    ] == []
    tests = "".join(path.read_text("utf-8") for path in Path(__file__).parent.glob("test_*.py"))
    named = re.findall(r"`(test_\w+)`", text)
    assert [name for name in named if f"def {name}(" not in tests] == []
