"""Help, completion and what is said where an extra is missing; the rest is in ../campaign."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete
from click.testing import CliRunner

from tickrig.emulators.commands.cli import main
from tickrig.emulators.testing.commands.campaign_cli import campaign, run


def completed(*words: str, begun: str = "") -> set[str]:
    completion = ShellComplete(main, {}, "tickrig", "_TICKRIG_COMPLETE")
    return {item.value for item in completion.get_completions(["campaign", *words], begun)}


def test_commands_options_and_files_are_completed() -> None:
    assert {"run", "merge"} <= completed()
    assert {"--seeds", "--shard"} <= completed(begun="--s")
    assert {"--seeds", "--shard"} <= completed("tests", begun="--s")
    assert {"--seeds", "--shard"} <= completed("run", "tests", begun="--s")
    assert completed("merge", begun="--o") == {"--output"}


def test_help_has_examples_of_options_that_there_are() -> None:
    for words in ([], ["run"], ["merge"]):
        text = CliRunner().invoke(campaign, [*words, "--help"]).output
        assert "tickrig campaign " in text
        known = {*run.get_params(run.make_context("run", [], resilient_parsing=True))}
        options = {option for each in known for option in each.opts}
        assert set(re.findall(r"tickrig campaign .*?(--\w+)", text)) <= options


@pytest.mark.parametrize(
    ("missing", "words", "said"),
    [
        ("pyarrow", ["-o", "a.parquet"], "Parquet needs pyarrow: pip install 'tickrig[campaign]'"),
        ("pyarrow", ["-o", "a.csv", "-o", "b.parquet"], "Parquet needs pyarrow"),
    ],
)
def test_what_an_extra_would_have_is_said(
    missing: str, words: list[str], said: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, missing, None)
    result = CliRunner().invoke(campaign, ["test_x.py", "--seeds", "1", *words])
    assert result.exit_code == 2
    assert result.stderr.startswith(f"Error: {said}")
    assert result.stderr.count("\n") == 1


def test_a_table_in_parquet_is_not_read_without_pyarrow(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    (tmp_path / "a.parquet").touch()
    words = ["merge", str(tmp_path / "a.parquet"), "-o", str(tmp_path / "b.csv")]
    result = CliRunner().invoke(campaign, words)
    assert result.exit_code == 2
    assert result.stderr == "Error: Parquet needs pyarrow: pip install 'tickrig[campaign]'\n"


def test_merging_what_is_not_there_is_told(tmp_path: Path) -> None:
    words = ["merge", str(tmp_path / "a.csv"), "-o", str(tmp_path / "b.csv")]
    result = CliRunner().invoke(campaign, words)
    assert (result.exit_code, result.stderr) == (
        2,
        f"Error: {tmp_path / 'a.csv'}: No such file or directory\n",
    )
