from __future__ import annotations

import gzip
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.host.canmon.cli import main
from tickrig.host.canmon.model.logs.log_reader import read_log

CANMON = (sys.executable, "-c", "from tickrig.host.canmon.cli import main; main()")

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


@pytest.mark.parametrize("words", [(), ("run.log",)])
def test_a_missing_log_is_called_log(words: tuple[str, ...]) -> None:
    result = canmon("conv", *words)
    assert result.exit_code == 2
    assert "Missing argument 'LOG'" in result.stderr


def test_what_a_format_cannot_hold_is_said(tmp_path: Path) -> None:
    result = canmon("conv", log(tmp_path), tmp_path / "run.trc")
    assert result.stderr.splitlines() == [
        "run.trc: 1 error frames left out",
        "run.trc: 1 remote frames left out",
        "run.trc: bench became can1",
    ]


MARKED = """\
(0000000001.000000) can0 123#01
# trigger: emcy
(0000000002.000000) can0 124#02
# 12 frames were lost
# can0 is gone: Network is down
(0000000005.000000) can0 125#03
# can0 is back after 2.500000 s
"""


@pytest.mark.parametrize("ending", ["log", "log.gz", "jsonl", "asc", "trc", "pcapng"])
def test_marks_go_from_log_to_log_at_their_place(ending: str, tmp_path: Path) -> None:
    first, again = log(tmp_path, f"# a note\n{MARKED}"), tmp_path / "again.log"
    assert canmon("conv", first, tmp_path / f"other.{ending}").exit_code == 0
    result = canmon("conv", tmp_path / f"other.{ending}", again)
    assert (result.exit_code, again.read_text("ascii")) == (0, MARKED)
    assert result.stderr == f"{tmp_path}/other.{ending}: its recorder lost 12 frames\n"


@pytest.mark.parametrize(
    ("ending", "said"),
    [
        ("csv", "other.csv: 4 marks of gaps and triggers left out"),
        ("trace", "left out: 4 marks of gaps and triggers"),
    ],
)
def test_marks_that_a_format_cannot_hold_are_said(ending: str, said: str, tmp_path: Path) -> None:
    assert said in canmon("conv", log(tmp_path, MARKED), tmp_path / f"other.{ending}").stderr


def test_marks_of_a_blf_log_are_not_read_and_that_is_said(tmp_path: Path) -> None:
    canmon("conv", log(tmp_path, MARKED), tmp_path / "run.blf")
    result = canmon("conv", tmp_path / "run.blf", tmp_path / "again.log")
    assert "4 objects that are no frames passed over" in result.stderr


def test_marks_stay_where_a_log_is_filtered_merged_and_shown(tmp_path: Path) -> None:
    first, other = log(tmp_path, MARKED), log(tmp_path, "(3.0) b 126#\n", "b.log")
    shown = canmon("dump", f"{first},124:7FF", other, "-L").stdout
    assert shown.splitlines() == [
        "# trigger: emcy",
        "(0000000002.000000) can0 124#02",
        "# 12 frames were lost",
        "# can0 is gone: Network is down",
        "(0000000003.000000) b 126#",
        "# can0 is back after 2.500000 s",
    ]


def test_marks_of_standard_input_are_kept_and_not_said_again(tmp_path: Path) -> None:
    lines = canmon("dump", log(tmp_path, MARKED), "--jsonl").stdout
    out = tmp_path / "x.log"
    words = [*CANMON, "dump", "-", "-l", str(out)]
    result = subprocess.run(words, input=lines, capture_output=True, text=True, check=False)
    assert (result.returncode, out.read_text("ascii")) == (0, MARKED)
    assert result.stderr == "standard input: its recorder lost 12 frames\n"


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


def test_info_says_where_it_does_not_look_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "run.log.gz"
    with gzip.open(path, "wt") as file:
        file.write(LOG[:32] * 1_500)
    path.write_bytes(path.read_bytes()[:-8])
    last = canmon("info", path).stdout.splitlines()[-1]
    assert last == "  last     not read, nor whether the log was ended: canmon stats does"
    assert canmon("stats", path).exit_code == 3


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


@pytest.mark.realtime
def test_a_log_that_is_interrupted_leaves_the_one_of_before(tmp_path: Path) -> None:
    source, out = log(tmp_path, LOG * 100_000, "in.log"), log(tmp_path, "before\n", "out.log")
    words = ["-c", "from tickrig.commands import canmon; canmon()", "conv", str(source)]
    with subprocess.Popen([sys.executable, *words, str(out)]) as process:
        while not list(tmp_path.glob(".tickrig.*/out.log")):
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        assert process.wait() == 130
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in.log", "out.log"]
    assert out.read_text("ascii") == "before\n"
