from __future__ import annotations

import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.host.canmon.cli import main

DRIVE = str(Path(__file__).parents[3] / "golden/canmon/drive.log")


def tui(*words: str) -> Result:
    return CliRunner().invoke(main, ["tui", *words])


def test_without_textual_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "tickrig.host.canmon.tui.app", raising=False)
    monkeypatch.setitem(sys.modules, "textual.app", None)
    result = tui(DRIVE)
    assert result.exit_code == 2
    assert result.stderr.startswith("Error: canmon tui needs Textual: pip install 'tickrig[tui]'")
    assert len(result.stderr.splitlines()) == 1


def test_without_a_terminal_it_names_top() -> None:
    result = tui(DRIVE)
    assert (result.exit_code, result.stdout) == (2, "")
    assert "needs a terminal; canmon top prints" in result.stderr


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("[bus\n", "line 1: "),
        ("[bus]\nsource = 3\n", "line 2: bus.source: is no array of texts"),
        ("[trace]\n\nfilter = 'node ='\n", "line 3: trace.filter: filter 'node =', column"),
        ("[statistics]\nsort = 'size'\n", "line 2: statistics.sort: 'size' is not one of id, rate"),
    ],
)
def test_a_broken_workspace_is_told_with_its_line_and_left_alone(
    text: str, reason: str, tmp_path: Path
) -> None:
    path = tmp_path / "bench.toml"
    path.write_text(text, "utf-8")
    result = tui(DRIVE, "-w", str(path))
    assert result.exit_code == 2
    assert result.stderr.startswith(f"Error: {path}, {reason}")
    assert len(result.stderr.splitlines()) == 1
    assert path.read_text("utf-8") == text


@pytest.mark.parametrize(
    ("words", "status", "reason"),
    [
        ((), 2, "no SOURCE"),
        (("socketcan:nowhere",), 3, "nowhere"),
        (("no.log",), 3, "No such file"),
        ((DRIVE, "--eds", "3"), 2, "--eds '3' is not NODE=FILE"),
        ((DRIVE, "--eds", "3=no.eds"), 2, "--eds no.eds: No such file"),
        ((DRIVE, "--dbc", "no.dbc"), 2, "--dbc no.dbc: No such file"),
    ],
)
def test_mistakes_are_told_in_one_line(words: tuple[str, ...], status: int, reason: str) -> None:
    result = tui(*words)
    assert result.exit_code == status
    assert reason in result.stderr
    assert len(result.stderr.splitlines()) == 1
