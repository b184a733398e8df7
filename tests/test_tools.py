"""The tools load what they name, and do a little of what they do; how fast is not looked at."""

from __future__ import annotations

import runpy
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

TOOLS = Path(__file__).parents[1] / "tools"
RUN_ELSEWHERE = {"picture"}
"""A test of its own runs it whole."""

PROGRAMS = [
    path.name
    for path in sorted(TOOLS.iterdir())
    if path.is_file()
    and path.name not in RUN_ELSEWHERE
    and path.read_text("utf-8").startswith(("#!/usr/bin/env python3", '"""'))
]
BENCHMARKS = sorted(path.stem for path in (TOOLS / "benchmarks").glob("*.py"))
QUICK = [("rrc", "bare"), ("rrc", "idle"), ("can", "lengths"), ("canopen", "block_download")]


@pytest.fixture(autouse=True)
def _as_a_program(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let tools change where modules are found, as long as the test runs."""
    monkeypatch.setattr(sys, "path", [str(TOOLS), *sys.path])


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_tool_finds_what_it_imports(name: str) -> None:
    assert runpy.run_path(str(TOOLS / name), run_name="tool")["__doc__"]


@pytest.mark.parametrize("name", BENCHMARKS)
def test_a_benchmark_finds_what_it_imports(name: str) -> None:
    assert import_module(f"benchmarks.{name}").__doc__


@pytest.mark.parametrize(("module", "name"), QUICK)
def test_a_benchmark_runs(
    module: str, name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(import_module("benchmarks.table"), "RUNS", 1)
    getattr(import_module(f"benchmarks.{module}"), name)()
    assert capsys.readouterr().out.startswith("| ")


def test_random_lines_are_thrown_at_a_device() -> None:
    done = subprocess.run(
        [sys.executable, TOOLS / "fuzz", "rrc", "--files", "1", "--seed", "3"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.startswith("seed 3: 1 files, {"), done.stderr


@pytest.mark.parametrize(
    "row", ["SDO download of 6040h through a bench", "RRC output", "canmon check of three lines"]
)
def test_a_trip_is_counted(row: str) -> None:
    tool = runpy.run_path(str(TOOLS / "trips"), run_name="tool")
    counter = tool["counted"](tool["TRIPS"][row])
    assert 5 < len(counter.own_files) < 50
    assert all((TOOLS.parent / file).is_file() for file in counter.own_files)
    assert counter.calls > len(counter.own_files)
