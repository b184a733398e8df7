"""Reports in files: the page, and the JSON that it can be made of later."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Final

from tickrig.emulators.testing.report.bench_report import BenchReport
from tickrig.emulators.testing.report.report_json import from_json, to_json
from tickrig.host.text.whole_file import check_file, is_special, write_whole

PAGES: Final = (".html", ".htm", "")
JSON: Final = ".json"
"""Ends the name of a report that is kept as JSON."""


def check_report(path: Path) -> None:
    """See before a run whether its report could be written after it.

    Raises:
        ValueError: Jinja2 is not there, the folder is not, or nothing can be written to it; or
            the name is that of a folder, or of a kind of file that no report is.
    """
    if path.suffix.lower() not in (*PAGES, JSON) and not is_special(path):
        raise ValueError(f"report {path}: it is a page, as report.html, or JSON, as report.json")
    if path.suffix.lower() != JSON and find_spec("jinja2") is None:
        raise ValueError("a report needs Jinja2: pip install 'tickrig[report]'")
    check_file(path, "report")


def write_report(report: BenchReport, path: Path) -> None:
    """Write the page of a report; JSON, as `write_run`, if the name ends in `.json`.

    A file of this name is replaced when the new one is whole, else it stays as it is.

    Raises:
        OSError: the file cannot be written; its `filename` is `path`.
        ImportError: Jinja2 (extra `report`) is not there.
    """
    if path.suffix.lower() == JSON:
        write_run(report, path)
        return
    from tickrig.emulators.testing.report.page import html_page  # noqa: PLC0415 - an extra

    write_whole(path, html_page(report))


def write_run(report: BenchReport, path: Path) -> None:
    """Write a report as JSON, whole or not at all.

    Raises:
        OSError: the file cannot be written; its `filename` is `path`.
    """
    write_whole(path, to_json(report) + "\n")


def read_run(path: Path) -> BenchReport:
    """Read a report that `write_run` wrote.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no report; the text says where and what.
    """
    try:
        text = path.read_text("utf-8")
    except UnicodeDecodeError as error:
        raise ValueError(f"not JSON: the byte at {error.start} is no UTF-8") from None
    if not text:
        raise ValueError("not JSON: it is empty")
    return from_json(text)
