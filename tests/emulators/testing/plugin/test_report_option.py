from __future__ import annotations

import pytest

from tests.emulators.testing.plugin.conftest import Run
from tests.emulators.testing.plugin.test_bench_fixture import RRC
from tickrig.emulators.testing.report.bench_report import (
    BenchReport,
    Outcome,
    PlannedFault,
    TestRecord,
)
from tickrig.emulators.testing.report.report_file import read_run

pytest_plugins = ("pytester", "xdist")

TESTS = """
import pytest
from tickrig.emulators.testing.bench.errors import PortGone

def press(bench):
    bench.press("power_button")
    bench.run_for("1s")

@pytest.mark.req("SAF-1")
def test_passes(bench):
    press(bench)

@pytest.mark.req("SAF-1", "SAF-2")
def test_fails(bench):
    bench.fault("flip=0.01@10ms-20ms")
    bench.fault("vr2_fault@600ms")
    press(bench)
    assert bench.get("state") == "Lost"

def test_blocked(bench):
    raise PortGone("no port")

@pytest.mark.needs("hardware")
def test_skipped(bench):
    pass

@pytest.mark.xfail(reason="not yet")
def test_is_expected_to_fail(bench):
    assert 0

def test_has_a_broken_fixture(bench, request):
    request.getfixturevalue("nothing")

@pytest.fixture
def broken(bench):
    assert 0

def test_of_a_broken_fixture(broken):
    pass

@pytest.mark.req("SAF-3")
def test_without_a_bench():
    pass

def test_of_nothing():
    pass
"""

OUTCOMES = {
    "test_passes": Outcome.PASSED,
    "test_fails": Outcome.FAILED,
    "test_blocked": Outcome.BLOCKED,
    "test_skipped": Outcome.SKIPPED,
    "test_is_expected_to_fail": Outcome.SKIPPED,
    "test_has_a_broken_fixture": Outcome.FAILED,
    "test_of_a_broken_fixture": Outcome.ERROR,
    "test_without_a_bench": Outcome.PASSED,
}


def by_name(report: BenchReport) -> dict[str, TestRecord]:
    return {test.nodeid.partition("::")[2]: test for test in report.tests}


@pytest.mark.parametrize("in_a_worker", [False, True])
def test_a_report_tells_of_each_test_that_has_a_bench(
    pytester: pytest.Pytester, run: Run, run_apart: Run, in_a_worker: bool
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(TESTS)
    options = ("--bench-report", "run.json", "--bench-seed", "5")
    result = run_apart("-n1", *options) if in_a_worker else run(*options)
    result.stdout.fnmatch_lines(["bench: */run.json tells of 8 tests"])
    report = read_run(pytester.path / "run.json")
    tests = by_name(report)
    assert {name: test.outcome for name, test in tests.items()} == OUTCOMES
    assert [one.name for one in report.requirements] == ["SAF-1", "SAF-2", "SAF-3"]
    (environment,) = report.runs
    assert (environment.mode, environment.seed) == ("virtual", 5)
    failed = tests["test_fails"]
    assert (failed.mode, failed.virtual_us, failed.seed) == ("virtual", 1_000_000, 5)
    assert failed.requirements == ("SAF-1", "SAF-2")
    assert failed.reason.startswith("AssertionError: assert ")
    assert failed.command.endswith("::test_fails --bench-seed 5")
    assert failed.faults == (
        PlannedFault("flip=0.01", 10_000, 20_000),
        PlannedFault("vr2_fault", 600_000),
    )
    assert ("!", "vr2_fault=1") in [(line.mark, line.text) for line in failed.journal]
    assert {"state", "vr2_power"} <= {series.name for series in failed.series}
    assert failed.trace.startswith("# tickrig-trace v2")
    assert tests["test_blocked"].reason == "no port"
    assert tests["test_skipped"].reason == "needs hardware, and this bench is virtual"
    assert tests["test_is_expected_to_fail"].reason == "expected to fail: not yet"


def test_a_page_is_written(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(TESTS)
    run("--bench-report", "out.html", "--bench-artifacts", "kept")
    page = (pytester.path / "out.html").read_text()
    assert page.startswith("<!doctype html>")
    assert "vr2_fault" in page
    assert ".trace" in page


def test_a_report_tells_what_differs(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        runs = []

        def test_one(bench):
            runs.append(1)
            bench.run_for(len(runs))
        """
    )
    run("--bench-report", "run.json", "--bench-compare")
    (test,) = read_run(pytester.path / "run.json").tests
    assert test.outcome is Outcome.FAILED
    assert test.reason == "the second run differs from the first at line 25"


def test_a_report_that_cannot_be_written_is_a_line(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile("def test_one(bench):\n    pass\n")
    (pytester.path / "out.json").symlink_to("/dev/full")
    result = run("--bench-report", "out.json")
    assert result.ret == pytest.ExitCode.INTERNAL_ERROR
    result.stdout.fnmatch_lines(["bench: */out.json was not written: No space left on device"])
