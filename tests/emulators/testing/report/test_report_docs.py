"""docs/reference/bench/report.md: its programs and commands, in the order in which they stand."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.emulators.testing.plugin.conftest import Run
from tests.emulators.testing.report.html_tree import Element, parse_page
from tickrig.emulators.commands.cli import main
from tickrig.emulators.testing.plugin import pytest_plugin

pytest_plugins = ("pytester",)

TEXT = (Path(__file__).parents[4] / "docs" / "reference/bench/report.md").read_text("utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, re.DOTALL | re.MULTILINE)


COMMANDS = [
    *(line[2:] for block in blocks("console") for line in block.splitlines()),
    *re.findall(r"pytest [\w. -]+", "".join(blocks("yaml"))),
]


def run_tickrig(*words: str) -> None:
    result = CliRunner().invoke(main, words)
    assert (result.exit_code, result.stdout) == (0, ""), result.output


def page() -> Element:
    return parse_page(Path("bench.html").read_text("utf-8"))


@pytest.fixture
def run_pytest(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run pytest with the plug-in of the tree and no other."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.delenv("PYTEST_ADDOPTS", raising=False)
    return lambda *words: pytester.runpytest_inprocess(*words, plugins=[pytest_plugin])


@pytest.mark.realtime
def test_the_commands_make_the_pages(pytester: pytest.Pytester, run_pytest: Run) -> None:
    pytester.makepyfile(test_chair=blocks("python")[0])
    pytester.makeini("[pytest]")
    heads = []
    for line in COMMANDS:
        program, *words = shlex.split(line)
        if program == "pytest":
            run_pytest(*words).assert_outcomes(passed=1)
        else:
            run_tickrig(*words)
        heads.append(page().all("header")[0].words)
    counts = [re.findall(r"[0-9]+ \w+ of [0-9]+ tests?", head) for head in heads]
    one, two = ["1 passed of 1 test"], ["2 passed of 2 tests"]
    assert counts == [one, one, one, one, two, one, one]
    assert "Wheelchair, release 2" in heads[4]


def test_the_program_keeps_a_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(blocks("python")[1], "docs/reference/bench/report.md", "exec"), {})
    run_tickrig("report", "mine.json", "-o", "bench.html")
    (row,) = page().by_class("requirements")[0].all("tr")[1:]
    assert row.words.startswith("SAF-12 A pulled bus stops the chair within 200 ms shown 1 of 1")


def test_each_named_test_is_there() -> None:
    folder = Path(__file__).parent
    source = "".join(path.read_text("utf-8") for path in folder.glob("test_*.py"))
    named = re.findall(r"`(test_\w+)`", TEXT)
    assert named
    assert [name for name in named if f"def {name}(" not in source] == []


def test_the_requirements_are_shown_as_told(pytester: pytest.Pytester, run_pytest: Run) -> None:
    listed, told = blocks("text")
    pytester.makepyfile(test_chair=blocks("python")[0])
    (pytester.path / "saf.txt").write_text(listed, "utf-8")
    result = run_pytest("--bench-report", "bench.html", "--bench-requirements", "saf.txt")
    result.stdout.fnmatch_lines(told.splitlines())
    rows = page().by_class("requirements")[0].all("tr")[1:]
    assert [row.words for row in rows] == [
        "SAF-13 An alarm is heard not shown 0 of 0 no test names it",
        "SAF-12 A pulled bus stops the chair within 200 ms shown 1 of 1",
    ]
