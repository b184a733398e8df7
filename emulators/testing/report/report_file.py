"""Reports in files: the page, and the JSON that it can be made of later."""

from __future__ import annotations

import os
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from tickrig.emulators.testing.report.bench_report import BenchReport
from tickrig.emulators.testing.report.report_json import from_json, to_json

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
    if not path.parent.is_dir():
        raise ValueError(f"report {path}: no directory {path.parent}")
    if path.is_dir():
        raise ValueError(f"report {path}: it is a directory")
    if not is_special(path):
        try:
            check_writable(path.resolve().parent)
        except OSError as error:
            raise ValueError(f"report {path}: {error.strerror}") from None


def is_special(path: Path) -> bool:
    """Return whether it is something else than a file or folder, such as a pipe."""
    return path.exists() and not (path.is_file() or path.is_dir())


def check_writable(folder: Path) -> None:
    """See whether files can be made in a folder, by making one; it may be a folder to be made.

    Raises:
        OSError: none can.
    """
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    beside = folder / f".tickrig.{os.getpid()}"
    try:
        beside.write_bytes(b"")
    finally:
        with suppress(OSError):
            beside.unlink(missing_ok=True)


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


def write_whole(path: Path, text: str) -> None:
    """Replace a file when its text is on the disk; what is no file, as a pipe, is written to.

    Raises:
        OSError: the file cannot be written; its `filename` is `path`.
    """
    data = text.encode("utf-8", "backslashreplace")
    try:
        place = path.resolve()
        if place.exists() and not place.is_file():
            place.write_bytes(data)
        else:
            _replace(place, data)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error


def _replace(path: Path, data: bytes) -> None:
    beside = path.with_name(f".{path.name[:200]}.{os.getpid()}")
    try:
        beside.unlink(missing_ok=True)  # of a run that was killed
        with beside.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)
