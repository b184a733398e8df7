from __future__ import annotations

import pytest

from tickrig.emulators.testing.report.bench_report import (
    BenchReport,
    Outcome,
    Requirement,
    TestRecord,
)
from tickrig.emulators.testing.report.overview import (
    OverallVerdict,
    by_file,
    counts,
    reported,
    requirement_rows,
    slowest,
)

PASSED, FAILED, ERROR = Outcome.PASSED, Outcome.FAILED, Outcome.ERROR
BLOCKED, SKIPPED = Outcome.BLOCKED, Outcome.SKIPPED


def verdict_of(*outcomes: Outcome) -> OverallVerdict:
    tests = [TestRecord("t.py::t", outcome, requirements=("R",)) for outcome in outcomes]
    report = BenchReport(requirements=(Requirement("R"),))
    (row,) = requirement_rows(report, reported(tests))
    return row.verdict


@pytest.mark.parametrize(
    ("outcomes", "verdict"),
    [
        ((), OverallVerdict.NOT_SHOWN),
        ((PASSED,), OverallVerdict.SHOWN),
        ((PASSED, BLOCKED), OverallVerdict.SHOWN),
        ((BLOCKED,), OverallVerdict.NOT_SHOWN),
        ((SKIPPED, BLOCKED), OverallVerdict.NOT_SHOWN),
        ((PASSED, FAILED), OverallVerdict.FAILED),
        ((ERROR, BLOCKED), OverallVerdict.FAILED),
    ],
)
def test_a_blocked_test_says_nothing_about_a_requirement(
    outcomes: tuple[Outcome, ...], verdict: OverallVerdict
) -> None:
    assert verdict_of(*outcomes) is verdict


def test_requirements_stand_by_verdict_and_then_by_number() -> None:
    tests = [
        TestRecord("t", PASSED, requirements=("SAF-10", "SAF-9", "SAF-9", "²")),
        TestRecord("u", FAILED, requirements=("Z",)),
    ]
    rows = requirement_rows(BenchReport(requirements=(Requirement("A"),)), reported(tests))
    assert [row.name for row in rows] == ["Z", "A", "SAF-9", "SAF-10", "²"]
    assert len(rows[2].tests) == 1


def test_files_stand_as_they_first_come_with_all_their_tests() -> None:
    tests = reported(TestRecord(name, PASSED) for name in ("b::1", "a::1", "b::2", "c", "b::1"))
    groups = [(file, [test.name for test in group]) for file, group in by_file(tests)]
    assert groups == [("b", ["1", "1", "2"]), ("a", ["1"]), ("c", ["c"])]


def test_outcomes_are_counted_in_their_order() -> None:
    tests = [TestRecord("t", outcome) for outcome in (PASSED, FAILED, PASSED)]
    assert list(counts(tests).items()) == [
        (FAILED, 1),
        (ERROR, 0),
        (BLOCKED, 0),
        (PASSED, 2),
        (SKIPPED, 0),
    ]


def test_the_slowest_come_first() -> None:
    tests = reported(TestRecord(f"t{n}", PASSED, wall_us=n) for n in range(20))
    assert [test.record.wall_us for test in slowest(tests)] == list(range(19, 9, -1))


def test_anchors_of_equal_names_are_numbered() -> None:
    names = ("a", "a", "a", "a-2", "é_1", "", "::")
    anchors = [test.anchor for test in reported(TestRecord(name, PASSED) for name in names)]
    assert anchors == ["t-a", "t-a-2", "t-a-3", "t-a-2-2", "t-é-1", "t-", "t--2"]
