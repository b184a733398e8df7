from __future__ import annotations

import os
import re
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tests.emulators.testing.report.real_runs import DRIVE, run_rrc
from tests.emulators.testing.report.test_report_json import REPORT
from tickrig.emulators.commands.cli import main
from tickrig.emulators.testing.report.bench_report import BenchReport, merge_reports
from tickrig.emulators.testing.report.report_file import read_run, write_report, write_run

ROOT = Path(__file__).parents[4]


def run(*words: str | Path) -> Result:
    return CliRunner().invoke(main, ["report", *map(str, words)])


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    """Run of an RRC as JSON."""
    test = run_rrc("tests/test_chair.py::test_it_stops", DRIVE, tmp_path / "stops.trace")
    path = tmp_path / "run.json"
    write_run(BenchReport("Chair", REPORT.runs, (test,)), path)
    return path


def test_a_run_is_kept_and_shown_later(kept: Path, tmp_path: Path) -> None:
    page = tmp_path / "bench.html"
    result = run(kept, "-o", page)
    assert (result.exit_code, result.stderr) == (0, f"{page}: 1 test\n")
    text = page.read_text("utf-8")
    assert "EV:PowerOffWaitByNoCommunication" in text
    write_report(read_run(kept), tmp_path / "again.html")
    assert (tmp_path / "again.html").read_bytes() == page.read_bytes()


def test_several_runs_are_one_page(kept: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.json"
    write_run(REPORT, other)
    result = run(kept, other, "-o", tmp_path / "bench.html", "--title", "Friday & all")
    assert (result.exit_code, result.stderr.rpartition(": ")[2]) == (0, "2 tests\n")
    text = (tmp_path / "bench.html").read_text("utf-8")
    assert "<h1>Friday &amp; all</h1>" in text
    assert "test_it_stops[fast]" in text


def test_runs_are_merged_into_one_that_is_kept(kept: Path, tmp_path: Path) -> None:
    other, both = tmp_path / "other.json", tmp_path / "both.JSON"
    write_run(REPORT, other)
    assert run(kept, other, "-o", both).exit_code == 0
    assert read_run(both) == merge_reports([read_run(kept), REPORT])


def test_a_page_does_not_depend_on_the_process(kept: Path, tmp_path: Path) -> None:
    program = "from tickrig.emulators.commands.cli import main; main()"
    pages = set()
    for seed in ("0", "1"):
        page = tmp_path / f"{seed}.html"
        subprocess.run(
            [sys.executable, "-c", program, "report", kept, "-o", page],
            env={"PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT / "src")},
            check=True,
            capture_output=True,
        )
        pages.add(page.read_bytes())
    assert len(pages) == 1


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b"{", "not JSON: Expecting property name"),
        (b"\xff\xfe", "not JSON: the byte at 0 is no UTF-8"),
        (b"", "not JSON: it is empty"),
        (b'{"tickrig-report": 9}', "report version 9; this program reads 1"),
        (b'{"tickrig-report": 1, "tests": [1]}', ".tests[0]: 1 is no object"),
    ],
)
def test_a_run_that_cannot_be_read_is_refused_in_a_line(
    text: bytes, said: str, tmp_path: Path
) -> None:
    bad = tmp_path / "bad.json"
    bad.write_bytes(text)
    result = run(bad, "-o", tmp_path / "bench.html")
    assert result.exit_code == 2
    assert result.stderr.startswith(f"Error: run {bad}: ")
    assert said in result.stderr
    assert result.stderr.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["bad.json"]


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    result = run(tmp_path / "no.json", "-o", tmp_path / "bench.html")
    assert (result.exit_code, result.stderr) == (
        2,
        f"Error: run {tmp_path}/no.json: No such file or directory\n",
    )


def test_a_folder_that_is_not_there_is_refused(kept: Path, tmp_path: Path) -> None:
    page = tmp_path / "no" / "bench.html"
    result = run(kept, "-o", page)
    assert (result.exit_code, result.stderr) == (
        2,
        f"Error: report {page}: no directory {page.parent}\n",
    )


def test_without_jinja_it_says_what_to_install(
    kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "jinja2", None)
    result = run(kept, "-o", tmp_path / "bench.html")
    said = "Error: a report needs Jinja2: pip install 'tickrig[report]'\n"
    assert (result.exit_code, result.stderr) == (2, said)
    assert run(kept, "-o", tmp_path / "again.json").exit_code == 0


def test_a_full_disk_leaves_the_file_of_before(kept: Path, tmp_path: Path) -> None:
    """A limit on the size of files stands in for the disk: the kernel refuses in both cases."""
    page = tmp_path / "bench.html"
    page.write_text("the page of yesterday", "utf-8")
    program = (
        "import resource, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (8_000, 8_000));"
        "from tickrig.emulators.commands.cli import main; main()"
    )
    process = subprocess.run(
        [sys.executable, "-c", program, "report", kept, "-o", page],
        env={"PYTHONPATH": str(ROOT / "src"), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (process.returncode, process.stderr) == (2, f"Error: report {page}: File too large\n")
    assert page.read_text("utf-8") == "the page of yesterday"
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "bench.html",
        "run.json",
        "stops.trace",
    ]


def test_a_page_has_the_rights_of_any_new_file_and_follows_links(tmp_path: Path) -> None:
    (tmp_path / "link.html").symlink_to(tmp_path / "page.html")
    before = os.umask(0o027)
    try:
        write_report(REPORT, tmp_path / "link.html")
    finally:
        os.umask(before)
    assert (tmp_path / "link.html").is_symlink()
    assert stat.S_IMODE((tmp_path / "page.html").stat().st_mode) == 0o640


def test_a_device_is_written_to_and_stays(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_run(BenchReport(), pipe)
        data = os.read(reader, 65_536)
    finally:
        os.close(reader)
    assert re.match(rb'\{"tickrig-report":1,', data)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
