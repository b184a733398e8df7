from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.emulators.testing.plugin.conftest import Run
from tests.emulators.testing.plugin.test_bench_fixture import RRC
from tests.emulators.testing.plugin.test_verdicts import BUS
from tickrig.emulators.testing.plugin.failure_report import stem_of
from tickrig.wire.can import parse_log

pytest_plugins = ("pytester",)

TESTS = f"""{BUS}
        @pytest.mark.parametrize("name", ["../../../etc/x y", "plain"])
        def test_one(bench, name):
            bench.run_for("100ms")
            assert name == "plain"
"""


def kept(folder: Path) -> dict[str, list[str]]:
    """Return the suffixes that were kept of each test."""
    found: dict[str, list[str]] = {}
    for path in sorted(folder.rglob("*")):
        assert path.parent == folder
        found.setdefault(path.stem, []).append(path.suffix)
    return found


def test_what_a_failed_test_did_is_kept(pytester: pytest.Pytester, run: Run) -> None:
    module = pytester.makepyfile(TESTS).name
    result = run("--bench-artifacts", "kept/here")
    folder = pytester.path / "kept" / "here"
    stem = stem_of(f"{module}::test_one[../../../etc/x y]")
    assert kept(folder) == {stem: [".log", ".trace", ".txt"]}
    assert str(parse_log((folder / f"{stem}.log").read_text())[0]).endswith("can 701#00")
    assert "can < 701#00" in (folder / f"{stem}.txt").read_text()
    result.stdout.fnmatch_lines(
        ["*- bench: what was kept -*", f"tickrig replay kept/here/{stem}.trace"]
    )


def test_what_every_test_did_is_kept(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(TESTS)
    run("--bench-artifacts", "kept", "--bench-artifacts-of", "every")
    assert len(kept(pytester.path / "kept")) == 2


def test_a_full_disk_is_a_line(pytester: pytest.Pytester, run: Run) -> None:
    module = pytester.makepyfile(TESTS).name
    stem = stem_of(f"{module}::test_one[../../../etc/x y]")
    (pytester.path / "kept").mkdir()
    for suffix in (".log", ".txt"):
        (pytester.path / "kept" / f"{stem}{suffix}").symlink_to("/dev/full")
    result = run("--bench-artifacts", "kept")
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(
        [
            f"tickrig replay kept/{stem}.trace",
            f"*/kept/{stem}.log was not written: No space left on device",
            f"*/kept/{stem}.txt was not written: No space left on device",
        ]
    )


@pytest.mark.parametrize(
    "nodeid", ["..::..", "/etc/passwd", "a" * 300, "a\0b\n", ".hidden", "-rf", "ä/ö.py::test_ü[..]"]
)
def test_no_name_of_a_test_leaves_the_folder(tmp_path: Path, nodeid: str) -> None:
    name = f"{stem_of(nodeid)}.trace"
    assert os.path.realpath(tmp_path / name) == str(tmp_path.resolve() / name)
    assert not name.startswith(("-", "."))
    assert len(name) < 100
    assert stem_of(nodeid) != stem_of(f"{nodeid} ")


def test_what_is_kept_no_more_is_counted(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makeconftest(RRC)
    pytester.makepyfile(
        test_x="""
        def test_one(bench):
            for number in range(10_001):
                bench.set("stick_v_pct", number % 2)
            assert 0
        """
    )
    result = run("--bench-artifacts", "kept")
    stem = stem_of("test_x.py::test_one")
    text = (pytester.path / "kept" / f"{stem}.txt").read_text().splitlines()
    missing = "1 line came before; the last 10000 are kept"
    assert (text[0], len(text)) == (f"({missing})", 10_001)
    result.stdout.fnmatch_lines([f"*/kept/{stem}.txt is not whole: {missing}"])
