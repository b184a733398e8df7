"""A report as text and as files: what `canmon conform` writes, for who judges in a program."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final
from warnings import warn

from tickrig.host.canmon.conform.chosen import unknown
from tickrig.host.canmon.conform.report_files import file_text
from tickrig.host.canmon.model.views.conform_frames import decoded_frames
from tickrig.host.canopen.conform.report.baseline import NONE_KNOWN, Baseline
from tickrig.host.canopen.conform.report.report_json import report_json
from tickrig.host.canopen.conform.report.text import text_report
from tickrig.host.canopen.conform.verdict import Report
from tickrig.host.text.page_text import one_line
from tickrig.host.text.whole_file import write_whole

KINDS: Final[Mapping[str, str]] = {
    ".html": "--html",
    ".xml": "--junit",
    ".svg": "--badge",
    ".md": "--issue",
    ".txt": "--write-baseline",
}
JSON: Final = ".json"


def conformance_text(report: Report, *, baseline: Path | str | None = None) -> str:
    """Return a report as `canmon conform` prints it.

    Args:
        report: of `conformance`.
        baseline: a file of known failures, which are named and not shown.

    Raises:
        OSError: the baseline cannot be read.
        ValueError: it is none.
    """
    return text_report(report, known_failures(baseline), decoded_frames({}))


def write_conformance(
    report: Report, path: Path | str, *, baseline: Path | str | None = None
) -> None:
    """Write a report into a file, whole or not at all.

    Args:
        report: of `conformance`.
        path: its ending says what is written: `.html` one page with all frames, `.xml` JUnit,
            `.svg` a badge, `.md` the failures to file as issues, `.json`, or `.txt` the failures
            as a baseline.
        baseline: a file of known failures.

    Raises:
        OSError: a file cannot be written or read.
        ValueError: another ending, or a baseline that is none.
        ImportError: a page, and Jinja2 is not there (extra `report`).
    """
    known, ending = known_failures(baseline), Path(path).suffix
    if ending == JSON:
        text = report_json(report, known)
    elif ending in KINDS:
        text = file_text(KINDS[ending], report, known, decoded_frames({}))
    else:
        endings = ", ".join([*KINDS, JSON])
        raise ValueError(f"{path}: nobody knows what to write, its ending is none of {endings}")
    write_whole(Path(path), text)


def known_failures(path: Path | str | None) -> Baseline:
    """Read a baseline, none without a file; an id in it that is no check is warned of.

    Raises:
        OSError: it cannot be read.
        ValueError: it is none.
    """
    if path is None:
        return NONE_KNOWN
    baseline = Baseline.read(Path(path))
    for text in unknown(sorted(baseline.known)):
        warn(one_line(f"baseline {path}: {text}"), stacklevel=3)
    return baseline
