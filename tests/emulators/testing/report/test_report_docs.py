"""The page docs/report.md: its program and its commands, in the order in which they stand."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.emulators.testing.report.html_tree import parse_page
from tickrig.emulators.commands.cli import main

TEXT = (Path(__file__).parents[4] / "docs" / "report.md").read_text("utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)


def test_the_program_keeps_a_run_and_the_commands_make_its_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (program,) = blocks("python")
    exec(compile(program, "docs/report.md", "exec"), {})
    Path("real.json").write_bytes(Path("virtual.json").read_bytes())
    lines = [line for block in blocks("console") for line in block.splitlines()]
    lines += [
        f"$ {line}" for line in re.findall(r"tickrig report [\w. -]+", "".join(blocks("yaml")))
    ]
    assert len(lines) == 4
    for line in lines:
        words = shlex.split(line.removeprefix("$ tickrig "))
        result = CliRunner().invoke(main, words)
        assert (result.exit_code, result.stdout) == (0, ""), result.output
        page = parse_page(Path("bench.html").read_text("utf-8"))
        assert "passed" in page.all("header")[0].words
        assert page.by_class("requirements")[0].all("tr")[1].words.startswith("SAF-12 A pulled bus")


def test_each_named_test_is_there() -> None:
    folder = Path(__file__).parent
    source = "".join(path.read_text("utf-8") for path in folder.glob("test_*.py"))
    named = re.findall(r"`(test_\w+)`", TEXT)
    assert named
    assert [name for name in named if f"def {name}(" not in source] == []
