"""The files of a conformance run: asked before it whether they can be, and written after it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from tickrig.host.canopen.conform.report.badge import badge
from tickrig.host.canopen.conform.report.baseline import Baseline, baseline_text
from tickrig.host.canopen.conform.report.evidence import ShowFrames
from tickrig.host.canopen.conform.report.issue import issue_text
from tickrig.host.canopen.conform.report.report_junit import report_junit
from tickrig.host.canopen.conform.verdict import Report
from tickrig.host.cli.messages import say
from tickrig.host.cli.refused import Refused
from tickrig.host.text.whole_file import check_file, check_not_read, write_whole

HTML: Final = "--html"


def check_files(files: Mapping[str, Path]) -> None:
    """See whether the files could be written; Refused if one could not.

    Args:
        files: by the option that names it.
    """
    for option, path in files.items():
        try:
            check_file(path, option)
        except ValueError as error:
            raise Refused(str(error)) from None
    if HTML in files and find_spec("jinja2") is None:
        raise Refused(f"{HTML} needs Jinja2: pip install 'tickrig[report]'")
    places = [path.resolve() for path in files.values()]
    if len(set(places)) < len(places):
        raise Refused("two reports cannot go into one file")


def keep_inputs(files: Mapping[str, Path], inputs: Iterable[Path]) -> None:
    """See that no report goes into what the run reads; Refused if one would.

    Args:
        files: by the option that names it.
        inputs: what is read; what is no file is none.
    """
    read = tuple(inputs)
    for option, path in files.items():
        try:
            check_not_read(path, option, read)
        except ValueError as error:
            raise Refused(str(error)) from None


def write_files(
    report: Report, files: Mapping[str, Path], baseline: Baseline, show: ShowFrames
) -> bool:
    """Write the files; say which could not be, and return whether all could.

    Args:
        report: the run.
        files: by the option that names it.
        baseline: failures that are known.
        show: writes frames.
    """
    written = True
    for option, path in files.items():
        try:
            write_whole(path, file_text(option, report, baseline, show))
        except OSError as error:
            say(f"Error: {option} {path}: {error.strerror}")
            written = False
    return written


def file_text(option: str, report: Report, baseline: Baseline, show: ShowFrames) -> str:
    """Return what the file that an option names holds.

    Args:
        option: `--html`, `--junit`, `--badge`, `--issue`, else the failures as a baseline.
        report: the run.
        baseline: failures that are known.
        show: writes frames.
    """
    match option:
        case "--html":
            from tickrig.host.canopen.conform.report.page import (  # noqa: PLC0415 - an extra
                html_page,
            )

            return html_page(report, baseline, show)
        case "--junit":
            return report_junit(report, baseline, show)
        case "--badge":
            return badge(report, baseline)
        case "--issue":
            return issue_text(report, baseline, show)
        case _:
            return baseline_text(report)
