from __future__ import annotations

from pathlib import Path

from click.testing import CliRunner, Result

from tickrig.host.canmon.cli import main
from tickrig.host.monitor.logs.log_reader import read_log

LOG = """\
(1436509052.249713) can0 705#7F
(1436509052.249714) can0 605#4000100000000000 T
(1436509052.249715) bench 00000123#0011223344556677
(1436509053.300000) can0 20000088#0000010000000000
(1436509054.000001) can0 123#R5
"""


def canmon(*words: object) -> Result:
    return CliRunner().invoke(main, [str(word) for word in words])


def log(folder: Path, text: str = LOG, name: str = "run.log") -> Path:
    path = folder / name
    path.write_text(text, "ascii")
    return path


def test_a_log_goes_through_blf_and_back(tmp_path: Path) -> None:
    first, again = log(tmp_path), tmp_path / "again.log"
    assert canmon("conv", first, tmp_path / "run.blf").stderr == "run.blf: bench became can1\n"
    assert canmon("conv", tmp_path / "run.blf", again).exit_code == 0
    assert again.read_text("ascii") == LOG.replace("bench", "can1")


def test_what_a_format_cannot_hold_is_said(tmp_path: Path) -> None:
    result = canmon("conv", log(tmp_path), tmp_path / "run.trc")
    assert result.stderr.splitlines() == [
        "run.trc: 1 error frames left out",
        "run.trc: 1 remote frames left out",
        "run.trc: bench became can1",
    ]


def test_logs_are_merged_and_filtered(tmp_path: Path) -> None:
    one = log(tmp_path, "(0000000001.000000) a 001#\n(0000000003.000000) a 003#\n", "one.log")
    two = log(tmp_path, "(0000000002.000000) b 002#\n", "two.log")
    out = tmp_path / "both.jsonl.gz"
    assert canmon("conv", one, two, out, "-F", "001-002").exit_code == 0
    assert [str(record.frame) for record in read_log(out)] == ["001#", "002#"]


def test_info_tells_what_a_log_is_from_its_ends(tmp_path: Path) -> None:
    path = log(tmp_path, LOG[:32] * 1_500 + LOG)
    assert canmon("info", path).stdout.splitlines() == [
        str(path),
        "  format   candump",
        f"  size     {path.stat().st_size:,} bytes",
        "  frames   1,000 at least",
        "  buses    can0",
        "  first    1436509052.249713 (2015-07-10 06:17:32 UTC)",
        "  last     1436509054.000001 (2015-07-10 06:17:34 UTC)",
        "  span     1.750288 s",
    ]


def test_info_of_an_empty_log_in_json(tmp_path: Path) -> None:
    path = log(tmp_path, "", "empty.log.gz")
    assert canmon("info", path, "--jsonl").stdout == (
        f'{{"v":1,"file":"{path}","format":"candump","gzip":true,"bytes":0,"frames":0,'
        '"channels":[],"first":null,"last":null,"bad_lines":0}\n'
    )


def test_info_of_what_is_no_log_fails(tmp_path: Path) -> None:
    assert canmon("info", log(tmp_path, "LOG", "run.blf")).exit_code == 3
    assert canmon("info", tmp_path / "nothing.log").exit_code == 3
    assert canmon("info", tmp_path / "run.xyz").exit_code == 2
