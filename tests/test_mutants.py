"""The list of mutants that may survive keeps pace with the code: `tools/mutants` runs them."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]


def load_tool() -> Any:
    spec = spec_from_loader("mutants", SourceFileLoader("mutants", str(ROOT / "tools" / "mutants")))
    assert spec is not None
    assert spec.loader is not None
    tool = module_from_spec(spec)
    sys.modules["mutants"] = tool
    spec.loader.exec_module(tool)
    return tool


TOOL = load_tool()


def identities(source: str) -> list[tuple[str, str, str]]:
    return [mutant.identity for mutant in TOOL.mutants_of(ast.parse(source))]


@pytest.mark.parametrize("listed", TOOL.read_list(), ids=lambda listed: listed.path)
def test_each_survivor_is_a_mutant_of_its_module_and_has_a_reason(listed: Any) -> None:
    mutants = identities((ROOT / listed.path).read_text())
    assert [one for one in listed.reasons if one not in mutants] == []
    assert all(listed.reasons.values())
    assert all((ROOT / test).exists() for test in listed.tests)


def test_the_share_of_survivors_is_below_5_percent() -> None:
    for listed in TOOL.read_list():
        mutants = identities((ROOT / listed.path).read_text())
        survivors = [one for one in mutants if one in listed.reasons]
        assert len(survivors) <= 0.05 * len(mutants), listed.path


@pytest.mark.parametrize(
    ("source", "after"),
    [
        ("x = a < b", ["x = a <= b"]),
        ("x = a == b", ["x = a != b"]),
        ("x = a and b", ["x = a or b"]),
        ("x = a + 1", ["x = a - 1", "x = a + 2"]),
        ("x = -a", ["x = +a"]),
        ("x = min(a, b)", ["x = max(a, b)"]),
        ("x = [a for a in b if a]", ["x = [a for a in b if not a]"]),
        ("if a:\n    b()\nelse:\n    c()", ["if not a:"]),
        ("while not a:\n    pass", ["while not not a:"]),
        ("def f(): a()", [""]),
        ("def f():\n    if a == b:\n        return", ["if a != b:", ""]),
        (
            "def f():\n    match a:\n        case b if c:\n            raise d",
            ["case b if not c:", ""],
        ),
    ],
)
def test_a_mutant_has_one_change(source: str, after: list[str]) -> None:
    assert [changed for _, _, changed in identities(source)] == after


@pytest.mark.parametrize(
    "source",
    [
        '"""What it is."""',
        "import a",
        "assert a == 1",
        "x: int | None",
        "def f() -> int | None: ...",
        "if TYPE_CHECKING:\n    a = 1",
        "@dataclass(frozen=True)\nclass A:\n    x: int = field(init=False)",
        "def f():\n    assert_never(a)",
    ],
)
def test_what_does_nothing_at_run_time_has_no_mutant(source: str) -> None:
    assert identities(source) == []


def test_a_swap_is_taken_back_by_another() -> None:
    tree = ast.parse("x = a < 1")
    for mutant in TOOL.mutants_of(tree):
        mutant.swap()
        assert ast.unparse(tree) != "x = a < 1"
        mutant.swap()
        assert ast.unparse(tree) == "x = a < 1"


@pytest.fixture
def tracer() -> Iterator[object]:
    before, ours = sys.gettrace(), lambda *_: None
    sys.settrace(ours)
    yield ours
    sys.settrace(before)


@pytest.mark.unmeasured
def test_what_coverage_leaves_out_is_seen_by_other_tracers(
    tracer: object, request: pytest.FixtureRequest
) -> None:
    measured = request.config.getoption("cov_source", [])
    assert sys.gettrace() is (None if measured else tracer)


def test_mutants_meet_the_tests_although_the_conftest_has_frozen_the_objects() -> None:
    command = [sys.executable, "tools/mutants", "wire/lines.py", "tests/wire/serial/test_lines.py"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert "wire/lines.py: 18 of 19 killed" in done.stdout, done
