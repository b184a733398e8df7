"""docs/reference/bench/pytest.md: its project and commands run, its tables are true."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from tests.emulators.testing.plugin.conftest import Run, skip_if_too_slow
from tickrig.emulators.testing.plugin import pytest_plugin
from tickrig.emulators.testing.plugin.bench_source import ALLOWED, HAND, KINDS
from tickrig.emulators.testing.plugin.settings import MODES, OPTIONS

pytest_plugins = ("pytester",)

PAGE = (Path(__file__).parents[4] / "docs" / "reference/bench/pytest.md").read_text("utf-8")
TESTS = re.findall(r"^(?:async )?def test_", PAGE, re.MULTILINE)


@pytest.fixture
def project(pytester: pytest.Pytester) -> None:
    programs = re.findall(r"^```python\n(# (\w+\.py)\n.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    assert len(programs) == PAGE.count("```python")
    for program, name in programs:
        (pytester.path / name).write_text(program)


def commands() -> list[str]:
    return re.findall(r"^\$ pytest ?(.*)$", PAGE, re.MULTILINE)


def column(head: str) -> list[str]:
    """Return the first words in code of the rows below a head."""
    rows = PAGE.partition(f"| {head} |")[2].partition("\n\n")[0].splitlines()[2:]
    return [re.match(r"\| `([\w-]+)", row)[1] for row in rows]  # type: ignore[index]


@pytest.mark.realtime
@pytest.mark.usefixtures("project")
@pytest.mark.parametrize("command", commands())
def test_its_commands_run(run: Run, command: str) -> None:
    result = run(*shlex.split(command))
    skip_if_too_slow(result)
    outcomes = result.parseoutcomes()
    assert outcomes.pop("passed") >= len(TESTS)
    assert outcomes == ({"skipped": 1} if "real" in command else {})


def test_its_options_are_those_of_the_plug_in() -> None:
    assert column("option") == [option.flag for option in OPTIONS]
    for option in OPTIONS:
        assert f"`{f'{option.flag} {option.metavar}'.strip()}`" in PAGE


def test_its_fixtures_are_those_of_the_plug_in(run: Run) -> None:
    listed = [line.partition(" ")[0] for line in run("--fixtures").outlines]
    assert sorted(column("fixture")) == sorted(n for n in listed if re.fullmatch(r"bench\w*", n))


def test_its_markers_are_those_of_the_plug_in() -> None:
    assert column("marker") == [line.partition("(")[0] for line in pytest_plugin.MARKERS]


@pytest.mark.parametrize("word", [*ALLOWED, *MODES, HAND])
def test_its_words_are_those_of_the_plug_in(word: str) -> None:
    assert f'`"{word}"`' in PAGE


@pytest.mark.parametrize("kind", KINDS)
def test_what_can_be_needed_is_named(kind: str) -> None:
    assert f'`"{kind}:' in PAGE
