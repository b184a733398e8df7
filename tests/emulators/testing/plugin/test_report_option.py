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
    result.stdout.fnmatch_lines(["bench: */run.json has 8 tests"])
    report = read_run(pytester.path / "run.json")
    tests = by_name(report)
    assert {name: test.outcome for name, test in tests.items()} == OUTCOMES
    assert report.requirements == ()  # nobody says which there are
    (environment,) = report.runs
    assert (environment.mode, environment.seed) == ("virtual", 5)
    failed = tests["test_fails"]
    assert (failed.mode, failed.virtual_us, failed.seed) == ("virtual", 1_000_000, 5)
    assert failed.requirements == ("SAF-1", "SAF-2")
    assert failed.reason.startswith("AssertionError: assert ")
    assert failed.command.endswith("::test_fails --bench-seed 5")
    assert failed.faults == (
        PlannedFault("flip=0.01", 10_000, 20_000, ordered_us=0),
        PlannedFault("vr2_fault", 600_000, ordered_us=0),
    )
    assert ("!", "vr2_fault=1") in [(line.mark, line.text) for line in failed.journal]
    assert {"state", "vr2_power"} <= {series.name for series in failed.series}
    assert failed.trace.startswith("# tickrig-trace v2")
    assert failed.expected == 'assert bench.get("state") == "Lost"'
    assert (tests["test_passes"].expected, tests["test_skipped"].expected) == ("", "")
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
    assert test.reason == "the second run differs from the first at line 33"


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (
            ("--bench-report", "x.pdf"),
            "report */x.pdf: it is a page, as report.html, or JSON, as report.json",
        ),
        (("--bench-report", "no/x.html"), "report */no/x.html: no directory */no"),
        (("--bench-report", "folder.html"), "report */folder.html: it is a directory"),
        (("--bench-report", "/proc/x.html"), "report /proc/x.html: *"),
        (("--bench-artifacts", "/proc/kept"), "--bench-artifacts /proc/kept: *"),
        (("--bench-artifacts", "a_file"), "--bench-artifacts */a_file: Not a directory"),
        (("--bench-artifacts", "a_file/x"), "--bench-artifacts */a_file/x: Not a directory"),
    ],
)
def test_where_nothing_can_be_written_is_told_before_the_tests(
    pytester: pytest.Pytester, run: Run, options: tuple[str, ...], told: str
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile("def test_one(bench):\n    open('ran', 'x')\n")
    pytester.mkdir("folder.html")
    (pytester.path / "a_file").touch()
    result = run(*options)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"ERROR: {told}"])
    assert not (pytester.path / "ran").exists()
    assert not [*pytester.path.glob("**/.tickrig.*")]


def test_a_report_that_cannot_be_written_is_a_line(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile("def test_one(bench):\n    pass\n")
    (pytester.path / "out.json").symlink_to("/dev/full")
    result = run("--bench-report", "out.json")
    assert result.ret == pytest.ExitCode.INTERNAL_ERROR
    result.stdout.fnmatch_lines(["bench: */out.json was not written: No space left on device"])


def test_the_fault_plan_tells_what_was_ordered_and_what_came(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makefile(
        ".toml",
        rig="""
        [device.rrc]
        type = "rrc"

        [device.scanner]
        type = "urg"

        [fault]
        rrc = ["cut@0ms-5ms", "flip=0.001@0s"]
        """,
    )
    pytester.makepyfile(
        test_x="""
        import pytest

        @pytest.mark.filterwarnings("ignore:a fault of this test never began")
        def test_faults(bench):
            rrc = bench["rrc"]
            rrc.fault("vr2_fault", when=rrc.on_line("EV:*", nth=1), for_="30ms")
            rrc.fault("bus_noise", when=lambda: bench.get("rrc/state") == "Lost")
            rrc.fault("cut@1s")
            rrc.fault("drop=0.5@5s")
            for number in range(6_000):
                bench["rrc"].set("stick_v_pct", number % 2)
                rrc.set("stick_w_pct", number % 2)
            bench.run_for("400ms")
            rrc.fault("cut@2s-3s")
            bench.set("rrc/bus_unplugged", 1)
            bench.run_for("2s")
            rrc.clear("flip")
        """
    )
    run("--bench", "rig.toml", "--bench-report", "run.json").assert_outcomes(passed=1)
    (test,) = read_run(pytester.path / "run.json").tests
    assert test.faults == (
        PlannedFault("rrc/cut", 0, 5_000, ordered_us=0),
        PlannedFault("rrc/flip=0.001", 0, 2_401_000, ordered_us=0),
        PlannedFault("rrc/vr2_fault", 11_000, 41_000, "the 1st EV:*", 0),
        PlannedFault("rrc/bus_noise", None, None, "the condition of test_x.py:7", 0),
        PlannedFault("rrc/cut", None, None, "1 s", 0),
        PlannedFault("rrc/drop=0.5", None, None, "5 s", 0),
        PlannedFault("rrc/cut", 2_000_000, None, ordered_us=401_000),
        PlannedFault("rrc/bus_unplugged", 401_000),
    )
    assert test.journal_left_out > 11_000
    assert "\n0.000000 rrc ~ cut\n" in test.trace


def test_what_changed_after_the_last_step_is_in_the_values(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        """
        def test_one(bench):
            bench.run_for("1s")
            bench.set("stick_v_pct", 40)
        """
    )
    run("--bench-report", "run.json").assert_outcomes(passed=1)
    (test,) = read_run(pytester.path / "run.json").tests
    (stick,) = [series for series in test.series if series.name == "stick_v_pct"]
    assert stick.points[-1] == (1_000_000, 40)


REQUIREMENTS = """\
# Wheelchair, release 2
SAF-1   A pulled bus stops the chair
SAF-2
SAF-4   Nobody has thought of this
"""


def test_requirements_that_no_test_names_are_shown(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeini("[pytest]\nbench_requirements = saf.txt\n")
    pytester.makeconftest(RRC)
    pytester.makepyfile(TESTS)
    (pytester.path / "saf.txt").write_text(REQUIREMENTS, "utf-8")
    result = run("--bench-report", "run.json")
    result.stdout.fnmatch_lines(
        [
            "bench: 0 of 3 requirements shown",
            "bench: no test names SAF-4",
            "bench: tests name unknown requirements: SAF-3",
        ]
    )
    report = read_run(pytester.path / "run.json")
    assert [one.name for one in report.requirements] == ["SAF-1", "SAF-2", "SAF-4"]
    assert report.requirements[0].text == "A pulled bus stops the chair"
    run().stdout.no_fnmatch_line("bench: *requirements*")


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        (None, "--bench-report run.json", "ERROR: */saf.txt: No such file or directory"),
        ("\n# none\n", "--bench-report run.json", "ERROR: */saf.txt: no requirement: write *"),
        (
            "A\nB\nA x\n",
            "--bench-report run.json",
            "ERROR: */saf.txt:3: A stands in line 1 *",
        ),
        ("A\n\udcff", "--bench-report run.json", "ERROR: */saf.txt: not UTF-8 at byte 2"),
        ("A\n", "", "ERROR: --bench-requirements: they belong in a report: add --bench-report"),
    ],
)
def test_requirements_that_cannot_be_read_are_a_line(
    pytester: pytest.Pytester, run: Run, text: str | None, options: str, said: str
) -> None:
    if text is not None:
        (pytester.path / "saf.txt").write_text(text, "utf-8", "surrogateescape")
    result = run("--bench-requirements", "saf.txt", *options.split())
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([said])


def test_tests_stand_as_in_their_files_in_whatever_order_they_were_run(
    pytester: pytest.Pytester, run: Run
) -> None:
    pytester.makeconftest(
        f"{RRC}\ndef pytest_collection_modifyitems(items):\n    items.reverse()\n"
    )
    many = "import pytest\n@pytest.mark.parametrize('n', [2, 10])\ndef test_z(bench, n): pass\n"
    pytester.makepyfile(test_b=TESTS, test_a=f"{many}\ndef test_a(bench): pass\n")
    run("--bench-report", "run.json")
    names = [test.nodeid for test in read_run(pytester.path / "run.json").tests]
    assert names[:3] == ["test_a.py::test_z[2]", "test_a.py::test_z[10]", "test_a.py::test_a"]
    assert names[3:] == [f"test_b.py::{name}" for name in OUTCOMES]
