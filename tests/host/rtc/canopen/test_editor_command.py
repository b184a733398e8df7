"""The command line of the System Editor."""

from __future__ import annotations

import sys

import pytest
from click.testing import CliRunner, Result

from tests.host.rtc.canopen.bench import EDS, SYSTEMS
from tickrig.host.rtc.canopen.commands.editor import main

FIG_120 = str(SYSTEMS / "fig120.yaml")


def run(*words: str) -> Result:
    return CliRunner().invoke(main, words)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ((f"{EDS}/none.yaml",), "none.yaml: No such file or directory"),
        ((f"{EDS}/f-palette.eds",), "f-palette.eds: line "),
        ((FIG_120,), "the editor needs a terminal; rtc-canopen-server does without one"),
        ((FIG_120, "--log", "-"), "--log -: the screen is on standard output; name a file"),
    ],
)
def test_what_cannot_be_is_one_line(words: tuple[str, ...], reason: str) -> None:
    result = run(*words)
    assert result.exit_code == 2
    assert reason in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_without_textual_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "tickrig.host.rtc.canopen.commands.editor_run", None)
    result = run(FIG_120)
    assert result.exit_code == 2
    assert "pip install 'tickrig[tui]'" in result.stderr


def test_the_help_has_examples() -> None:
    result = run("--help")
    assert result.exit_code == 0
    assert "rtc-canopen-editor robot.yaml -i socketcan -c vcan0 --start" in result.output
