"""The work of `tickrig report`: make one page of runs that were kept as JSON."""

from __future__ import annotations

from pathlib import Path

from tickrig.emulators.testing.report.bench_report import BenchReport, merge_reports
from tickrig.emulators.testing.report.report_file import check_report, read_run, write_report
from tickrig.host.cli.messages import Refused, refuse_path, say
from tickrig.host.text.values import counted


def make_report(runs: tuple[Path, ...], output: Path, title: str) -> None:
    """Read the runs and write the page, or JSON."""
    try:
        check_report(output)
    except ValueError as error:
        raise Refused(str(error)) from None
    report = merge_reports([_read(path) for path in runs], title)
    try:
        write_report(report, output)
    except OSError as error:
        refuse_path("report", error)
    say(f"{output}: {counted(len(report.tests), 'test')}")


def _read(path: Path) -> BenchReport:
    try:
        return read_run(path)
    except OSError as error:
        refuse_path("run", error)
    except ValueError as error:
        raise Refused(f"run {path}: {error}") from None
