"""Benches in other test frameworks: what their pages say is what happens."""

from __future__ import annotations

import os
import subprocess
import sys
import unittest
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Final

import pytest

from tests.environment import ROOT, Environment
from tests.page_runner import PageRunner
from tickrig import Bench
from tickrig.testing import BenchLibrary, BenchTestCase

HOWTO = ROOT / "docs" / "howto"
OTHER: Final = os.environ.get("FRAMEWORKS_PYTHON", "")
"""A Python with labgrid and pytest-embedded (`.ci/frameworks`): their plug-ins act in all tests."""

FOREIGN = pytest.mark.skipif(not OTHER, reason="no FRAMEWORKS_PYTHON: .ci/frameworks has it")
ROBOT = pytest.mark.skipif(find_spec("robot") is None, reason="no robotframework here")

PROGRAMS = {
    "python3": "",
    "robot": "-m robot",
    "pytest": "-c '{program}'",
}
PYTEST = """
import sys, pytest
from importlib.metadata import entry_points
from tickrig.emulators.testing.plugin import pytest_plugin as plugin
known = any(each.name == "tickrig" for each in entry_points(group="pytest11"))
sys.exit(pytest.main(sys.argv[1:], [] if known else [plugin]))
"""


@dataclass(frozen=True)
class Here(Environment):
    """An environment with the commands of the tree, and with all plug-ins that it has."""

    @property
    def variables(self) -> dict[str, str]:
        """What a shell in it has."""
        return {**super().variables, "PYTHONPATH": str(ROOT / "src"), "COLUMNS": "200"}


def runner_of(folder: Path, python: str) -> PageRunner:
    """Return what runs a page with an interpreter."""
    (folder / "bin").mkdir()
    for name, words in PROGRAMS.items():
        command = folder / "bin" / name
        options = words.format(program=PYTEST.replace("'", '"'))
        command.write_text(f'#!/bin/sh\nexec {python} {options} "$@"\n', "utf-8")
        command.chmod(0o755)
    (folder / "work").mkdir()
    return PageRunner(Here(folder), folder / "work")


@pytest.mark.parametrize("page", ["unittest", pytest.param("robot-framework", marks=ROBOT)])
def test_a_page_does_what_it_says(page: str, tmp_path: Path) -> None:
    runner = runner_of(tmp_path, sys.executable)
    runner.run(HOWTO / f"{page}.md")
    assert len(runner.typed) == 1


@FOREIGN
@pytest.mark.realtime
@pytest.mark.parametrize("page", ["labgrid", "pytest-embedded", "robot-framework"])
def test_a_page_of_a_plug_in_does_what_it_says(page: str, tmp_path: Path) -> None:
    runner = runner_of(tmp_path, OTHER)
    runner.run(HOWTO / f"{page}.md")
    assert len(runner.typed) == 1


@FOREIGN
def test_dut_is_skipped_in_virtual_time(tmp_path: Path) -> None:
    runner = runner_of(tmp_path, OTHER)
    runner.write_files(HOWTO / "pytest-embedded.md")
    done = subprocess.run(
        [tmp_path / "bin" / "pytest", "-rs", "test_chair.py"],
        cwd=runner.folder,
        env=runner.environment.variables,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "dut needs real time: --bench-mode real" in done.stdout, done.stdout + done.stderr


# unittest


class Chair(BenchTestCase):
    __test__ = False  # they are run by the tests below

    def make_bench(self) -> Bench:
        return Bench("rrc")

    def test_it_is_off(self) -> None:
        self.bench.run_for("1s")
        assert self.bench.get("state") == "WaitPowerOn"

    def test_it_is_on(self) -> None:
        self.bench.run_for("1s")
        assert self.bench.get("state") == "Standby"

    def test_it_has_a_terminal(self) -> None:
        self.bench.start(self.wrong())

    def test_its_host_hangs(self) -> None:
        port = self.bench.serial(timeout=60)
        try:
            while True:
                port.read()
        except AssertionError:
            pass

    async def wrong(self) -> None:
        raise ZeroDivisionError

    @unittest.skip("not now")
    def test_it_is_left_out(self) -> None:
        raise NotImplementedError

    @unittest.expectedFailure
    def test_it_is_known_to_fail(self) -> None:
        self.fail("known")


class Live(Chair):
    __test__ = False

    def make_bench(self) -> Bench:
        return Bench("rrc", mode="real")

    def test_it_is_off(self) -> None:
        self.bench.fork()


def ran(test: str, case: type[BenchTestCase] = Chair) -> unittest.TestResult:
    result = unittest.TestResult()
    case(test).run(result)
    assert result.testsRun == 1
    return result


def test_a_failure_has_what_passed_last() -> None:
    assert ran("test_it_is_off").wasSuccessful()
    ((_, said),) = ran("test_it_is_on").failures
    assert "assert 'WaitPowerOn' == 'Standby'" in said
    assert "what passed last:\n0.010000 rrc < EV:Initialized" in said


def test_a_task_that_failed_fails_the_test() -> None:
    ((_, said),) = ran("test_it_has_a_terminal").errors
    assert "ZeroDivisionError" in said


def test_a_host_that_hangs_fails_the_test_although_it_catches_the_error() -> None:
    ((_, said),) = ran("test_its_host_hangs").failures
    assert ": the host has waited for 3600.000000 s of virtual time" in said


def test_marks_of_unittest_count() -> None:
    assert ran("test_it_is_left_out").skipped
    assert ran("test_it_is_known_to_fail").expectedFailures


@pytest.mark.realtime
def test_what_a_bench_cannot_do_is_skipped() -> None:
    ((_, reason),) = ran("test_it_is_off", Live).skipped
    assert "virtual time" in reason


# Robot Framework


@pytest.fixture
def library() -> Iterator[BenchLibrary]:
    library = BenchLibrary()
    yield library
    library.close_bench()


def test_a_line_that_came_before_is_expected(library: BenchLibrary) -> None:
    library.open_bench("rrc")
    library.advance("1s")
    assert library.expect("EV:*") == "EV:Initialized"
    with pytest.raises(AssertionError, match="did not come within 100ms; what came: nothing"):
        library.expect("EV:*", within="100ms")


def test_what_came_instead_is_told(library: BenchLibrary) -> None:
    library.open_bench("rrc")
    with pytest.raises(AssertionError, match="what came: 'EV:Initialized'"):
        library.expect("OK:*")


def test_without_a_bench_it_is_told_what_opens_one(library: BenchLibrary) -> None:
    with pytest.raises(RuntimeError, match="no bench is open: use `Open Bench` first"):
        library.advance("1s")


def test_nodes_have_objects_and_faults(library: BenchLibrary, tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text('[device.axis1]\ntype = "epos"\n')
    library.open_bench(str(rig))
    library.advance("100ms")
    library.send_frame("601#4041600000000000", device="axis1")
    answer = library.expect("581#4B416000*")
    statusword = int.from_bytes(bytes.fromhex(answer[-8:]), "little")
    assert library.get_signal("axis1/0x6041") == statusword
    library.order_fault("axis1/sdo_mute", duration="1s")
    library.send_frame("601#4041600000000000")
    with pytest.raises(AssertionError, match="did not come within 500ms"):
        library.expect("581#*", within="500ms")
    library.clear_fault("axis1/sdo_mute")
    library.signal_should_be("axis1/0x6041", str(statusword))
    with pytest.raises(AssertionError, match=f"0x6041 is {statusword}, not 5 within 10ms"):
        library.signal_should_be("axis1/0x6041", "5", within="10ms")


def test_a_failed_test_shows_what_passed(library: BenchLibrary) -> None:
    library.open_bench("rrc")
    library.set_input("stick", "10", "20")
    library.advance("1s")
    result = SimpleNamespace(failed=True, message="it failed")
    library._end_test(None, result)
    assert "it failed\n\nWhat passed last:\n" in result.message
    assert "0.010000 rrc < EV:Initialized" in result.message
    with pytest.raises(RuntimeError, match="no bench is open"):
        library.press("power_button")


def test_the_supply_is_switched(library: BenchLibrary) -> None:
    library.open_bench("rrc")
    library.advance("1s")
    library.switch_off()
    library.signal_should_be("state", "Off", within="1s")
    library.switch_on()
    library.signal_should_be("state", "WaitPowerOn", within="1s")
