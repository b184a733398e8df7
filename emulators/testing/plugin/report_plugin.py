"""Records of tests, made in workers and collected by the process that writes the report."""

from __future__ import annotations

import json
from collections.abc import Generator, Iterator
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from operator import itemgetter
from pathlib import Path
from typing import Final

import pytest

from tickrig.emulators.testing.plugin.failure_report import outcome_of, repeat_command
from tickrig.emulators.testing.plugin.settings import PluginSettings
from tickrig.emulators.testing.plugin.stash import BENCHED
from tickrig.emulators.testing.report import overview
from tickrig.emulators.testing.report.bench_report import BenchReport, RunEnvironment, TestRecord
from tickrig.emulators.testing.report.report_file import (
    check_report,
    from_data,
    to_data,
    write_report,
)
from tickrig.host.text.values import counted

_RECORD: Final = "tickrig_record"
"""The attribute of the last report of a test that has its record as JSON."""

_OWN: Final = frozenset({"req", "parametrize", "usefixtures"})
_REPORTS: Final = pytest.StashKey[list[pytest.TestReport]]()
_EXPECTED: Final = pytest.StashKey[str]()
_MOST: Final = 400
"""Largest number of characters of the failed statement."""

_Place = tuple[str, int, list[tuple[int, str]]]


class ReportPlugin:
    """pytest plug-in for `--bench-report`: writes a report about all tests.

    Args:
        config: the configuration of pytest.
        settings: the settings of the plug-in, with the path of the report.

    Raises:
        OSError: the file with the requirements cannot be read.
        ValueError: the file with the requirements has errors, or the path of the report is not
            suitable.
    """

    def __init__(self, config: pytest.Config, settings: PluginSettings) -> None:
        if settings.report:
            check_report(settings.report)
        self._config, self._settings = config, settings
        path = settings.requirements
        self._requirements = overview.read_requirements(path) if path else ()
        self._records: dict[str, tuple[_Place, TestRecord]] = {}
        self._begun = datetime.now().astimezone()
        self._error = ""

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Add the record of a test to its last report."""
        report = yield
        if call.when == "setup":
            item.stash[_REPORTS] = []
        reports = item.stash.setdefault(_REPORTS, [])
        reports.append(report)
        if report.failed and call.excinfo and not item.stash.get(_EXPECTED, ""):
            item.stash[_EXPECTED] = _statement(item, call.excinfo)
        if call.when == "teardown" and _is_reported(item):
            setattr(report, _RECORD, json.dumps(to_data(_record_of(item, reports))))
        return report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Store the record of a test, which another process may have run."""
        if data := getattr(report, _RECORD, None):
            record = from_data(TestRecord, json.loads(data))
            self._records[record.nodeid] = _place(report), record

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Write the report, in the process that has all records."""
        path = self._settings.report
        if path is None or hasattr(self._config, "workerinput"):
            return
        try:
            write_report(self._report(), path)
        except OSError as error:
            self._error = f"bench: {path} was not written: {error.strerror}"
            session.exitstatus = session.exitstatus or pytest.ExitCode.INTERNAL_ERROR

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Print where the report is."""
        done = f"bench: {self._settings.report} has {counted(len(self._records), 'test')}"
        terminalreporter.write_line(self._error or done, red=bool(self._error))
        for line in self._shown():
            terminalreporter.write_line(f"bench: {line}")

    def _shown(self) -> Iterator[str]:
        """Yield lines about the requirements that the tests show."""
        if not self._requirements:
            return
        rows = overview.requirement_rows(self._report(), overview.reported(self._tests()))
        listed = [row for row in rows if row.listed]
        shown = sum(row.verdict is overview.OverallVerdict.SHOWN for row in listed)
        yield f"{shown} of {counted(len(listed), 'requirement')} shown"
        if untested := [row.name for row in listed if not row.tests]:
            yield f"no test names {', '.join(untested)}"
        if unknown := [row.name for row in rows if not row.listed]:
            yield f"tests name unknown requirements: {', '.join(unknown)}"

    def _tests(self) -> tuple[TestRecord, ...]:
        """Return the records in the order of the tests in the files."""
        return tuple(record for _, record in sorted(self._records.values(), key=itemgetter(0)))

    def _report(self) -> BenchReport:
        return BenchReport(
            runs=(self._environment(),), tests=self._tests(), requirements=self._requirements
        )

    def _environment(self) -> RunEnvironment:
        settings = self._settings
        rig_file = settings.rig_file
        return RunEnvironment(
            date=self._begun.strftime("%Y-%m-%d %H:%M:%S %z"),
            mode=", ".join(settings.modes),
            seed=settings.seed,
            rig_file=rig_file.name if rig_file else "",
            rig_text=rig_file.read_text("utf-8", "replace") if rig_file else "",
        ).of_this_machine()


def _place(report: pytest.TestReport) -> _Place:
    """Return the position of a test: file, line, and name with numbers in numeric order."""
    nodeid = str(report.nodeid)
    return nodeid.partition("::")[0], report.location[1] or 0, overview.natural(nodeid)


def _statement(item: pytest.Item, error: pytest.ExceptionInfo[BaseException]) -> str:
    """Return the last executed statement of a test in one line, or "" if none was executed."""
    for entry in reversed(error.traceback):
        if Path(entry.path) == item.path:
            with suppress(Exception):  # who has compiled the test need not have left its source
                return " ".join(str(entry.statement).split())[:_MOST]
    return ""


def _is_reported(item: pytest.Item) -> bool:
    """Return whether a report contains a test: the test has a bench, or shows a requirement."""
    return BENCHED in item.stash or item.get_closest_marker("req") is not None


def _record_of(item: pytest.Item, reports: list[pytest.TestReport]) -> TestRecord:
    """Return the record of a test.

    Args:
        item: the test.
        reports: reports of all phases of the test.
    """
    outcome, reason, longrepr = outcome_of(item, reports)
    record = TestRecord(
        str(item.nodeid),
        outcome,
        wall_us=sum(round(report.duration * 1e6) for report in reports),
        requirements=tuple(str(value) for name, value in item.user_properties if name == "req"),
        markers=tuple(dict.fromkeys(m.name for m in item.iter_markers() if m.name not in _OWN)),
        reason=reason,
        expected=item.stash.get(_EXPECTED, "") if outcome in overview.UNWELL else "",
        longrepr=longrepr,
        command=repeat_command(item),
    )
    return _with_bench(item, record)


def _with_bench(item: pytest.Item, record: TestRecord) -> TestRecord:
    """Add the data of the bench of a test to a record."""
    test = item.stash.get(BENCHED, None)
    if test is None:
        return record
    record = replace(record, mode=test.wanted.mode, artefacts=tuple(p.name for p in test.kept))
    if (seen := test.evidence) is None:
        return record
    return replace(
        record,
        mode=seen.mode,
        virtual_us=seen.now_us,
        seed=test.wanted.seed_used,
        faults=seen.faults,
        journal=seen.journal,
        journal_left_out=seen.left_out,
        series=seen.series,
        trace=seen.trace,
    )
