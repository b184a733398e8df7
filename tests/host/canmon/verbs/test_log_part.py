"""A part of a log, cut out by times; and filters that let nothing of a log pass."""

from __future__ import annotations

import gzip
import json
import subprocess
import sys
from datetime import datetime
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.host.canmon.cli import main
from tickrig.host.canmon.model.logs.log_reader import read_log

CANMON = (sys.executable, "-c", "from tickrig.host.canmon.cli import main; main()")
FIRST_S = 1_700_000_000
LOG = "".join(f"({FIRST_S + ms / 1e3:.6f}) can0 {0x181 + ms % 2:X}#{ms:04X}\n" for ms in range(10))
"""Ten frames, 1 ms apart."""
DATE = datetime.fromtimestamp(FIRST_S).isoformat(" ")
"""Of the first frame, in the zone of this machine."""


def canmon(*words: object) -> Result:
    return CliRunner().invoke(main, [str(word) for word in words])


def passed(result: Result) -> list[int]:
    """Return which frames are in lines of a log."""
    return [int(line.rpartition("#")[2], 16) for line in result.stdout.splitlines()]


PARTS = [
    (("--from", "0.003"), [3, 4, 5, 6, 7, 8, 9]),
    (("--from", "3ms", "--to", "5ms"), [3, 4, 5]),
    (("--to", "2000us"), [0, 1, 2]),
    (("--from", f"{FIRST_S}.007"), [7, 8, 9]),
    (("--from", f"({FIRST_S}.007)", "--to", f"{DATE}.0075"), [7]),
    (("--from", f"{DATE}.008"), [8, 9]),
    (("--from", "2023-11-14 22:13:20.008 UTC"), [8, 9]),
    (("--from", "2023-11-15T07:13:20.008+09:00"), [8, 9]),
    (("--from", "2022-01-01", "--to", "1ms"), [0, 1]),
]


@pytest.mark.parametrize(("words", "frames"), PARTS)
def test_a_part_of_a_log_is_cut_out_by_times(
    words: tuple[str, ...], frames: list[int], log: str, tmp_path: Path
) -> None:
    assert passed(canmon("dump", log, "-L", *words)) == frames
    assert canmon("conv", log, tmp_path / "part.log", *words).exit_code == 0
    assert len(list(read_log(tmp_path / "part.log"))) == len(frames)


def test_a_part_of_standard_input_ends_it() -> None:
    words = [*CANMON, "dump", "-", "-L", "--from", "3ms", "--to", "5ms"]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(LOG.encode())
        process.stdin.flush()  # and it stays open
        lines = process.stdout.read().decode().splitlines()
    assert (process.returncode, lines) == (0, LOG.splitlines()[3:6])


@pytest.mark.parametrize("verb", ["dump", "conv", "stats", "top", "nodes"])
def test_verbs_that_read_a_log_take_a_part_of_it(verb: str, log: str, tmp_path: Path) -> None:
    out = [tmp_path / "x.log"] * (verb == "conv")
    part = canmon(verb, log, *out, "--from", "3ms", "--to", "5ms")
    assert (part.exit_code, part.stderr) == (0, "")
    lines = "".join(LOG.splitlines(keepends=True)[3:6])
    Path(log).write_text(lines, "ascii")
    assert part.stdout == canmon(verb, log, *out).stdout


def test_a_part_is_checked_and_reported(log: str, tmp_path: Path) -> None:
    lines = [f"({FIRST_S + at}.0) can0 705#{5 if at else 0:02X}\n" for at in range(8)]
    lines.insert(5, f"({FIRST_S + 4}.5) can0 085#0010810000000000\n")
    Path(log).write_text("".join(lines), "ascii")
    for verb in (["check"], ["check", "--no-emcy"]):
        assert "EMCY" in canmon(*verb, log, "--from", "4").stdout
        assert "EMCY" not in canmon(*verb, log, "--from", "5").stdout
    page = tmp_path / "part.html"
    told = canmon("report", log, "-o", page, "--from", "4.2", "--to", "6")
    assert (told.exit_code, "3 frames" in told.stdout) == (0, True)
    told = canmon("report", log, "-o", page, "--from", "9")
    assert (told.exit_code, told.stderr.partition(";")[0]) == (1, "--from 9: no frame in this part")
    for verb in (["check"], ["check", "--no-emcy"]):
        none = canmon(*verb, log, "--from", "9")
        assert (none.exit_code, "--from 9: no frame in this part" in none.stderr) == (5, True)


@pytest.mark.parametrize("ending", ["log", "log.gz"])
def test_a_part_of_a_large_log_is_the_same(ending: str, tmp_path: Path) -> None:
    lines = "".join(f"({FIRST_S + at / 1e3:.6f}) can0 181#{at:08X}\n" for at in range(40_000))
    large = tmp_path / f"run.{ending}"
    large.write_bytes(gzip.compress(lines.encode(), 0) if ending == "log.gz" else lines.encode())
    words = "--from", "12.5", "--to", "12.75"
    assert passed(canmon("dump", large, "-L", *words)) == list(range(12_500, 12_751))
    assert canmon("conv", large, tmp_path / "part.log", *words).exit_code == 0
    part = (tmp_path / "part.log").read_text("ascii")
    assert part == "".join(lines.splitlines(keepends=True)[12_500:12_751])
    counted = json.loads(canmon("stats", large, "--jsonl", *words).stdout.splitlines()[0])
    assert counted["n"] == 251


def test_frames_that_were_lost_outside_a_part_are_not_lost_in_it(tmp_path: Path) -> None:
    marked = tmp_path / "run.log"
    lines = LOG.splitlines(keepends=True)
    marked.write_text("".join([*lines[:2], "# 7 frames were lost\n", *lines[2:]]), "ascii")
    before = canmon("dump", marked, "-L", "--from", "5ms", "--strict")
    assert (before.exit_code, "lost" in before.stdout) == (0, False)
    inside = canmon("dump", marked, "-L", "--from", "1ms", "--strict")
    assert (inside.exit_code, inside.stdout.splitlines()[1]) == (4, "# 7 frames were lost")


def test_times_count_from_the_first_of_all_frames(log: str, tmp_path: Path) -> None:
    other = tmp_path / "later.log"
    other.write_text(f"({FIRST_S}.004000) b 7FF#00FF\n", "ascii")
    words = "-L", "--from", "3ms", "--to", "4ms"
    assert sorted(passed(canmon("dump", other, log, *words))) == [3, 4, 255]
    assert passed(canmon("dump", f"{log},182:7FF", *words)) == [3]


def test_what_was_heard_before_a_part_is_known_in_it(tmp_path: Path) -> None:
    mapping = [
        "603#2F001A0001000000",
        "583#60001A0000000000",
        "603#23001A0110006C60",
        "583#60001A0100000000",
    ]
    log = tmp_path / "run.log"
    frames = enumerate([*mapping, "183#1234"])
    log.write_text("".join(f"({at}.0) can0 {frame}\n" for at, frame in frames), "ascii")
    whole = canmon("dump", log).stdout.splitlines()
    assert "606C" in whole[-1] or "velocity" in whole[-1]
    assert canmon("dump", log, "--from", "4").stdout.splitlines() == whole[-1:]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--from", "x"), "--from 'x' is not a time: write 2.5, 300ms after the first frame, or a"),
        (("--to", "2026-13-01"), "--to '2026-13-01' is not a date as 2026-11-29 12:00:05.5"),
        (("--from", "3s", "--to", "2"), "--to 2 is before --from 3s"),
        (("--from", "2027-01-01", "--to", "2026-01-01"), "--to 2026-01-01 is before --from 2027"),
    ],
)
def test_a_part_that_is_none_is_refused(words: tuple[str, ...], said: str, log: str) -> None:
    result = canmon("dump", log, *words)
    assert result.exit_code == 2
    assert said in result.stderr


@pytest.mark.parametrize("verb", ["dump", "stats", "top", "nodes"])
def test_a_part_of_a_bus_is_refused(verb: str) -> None:
    result = canmon(verb, "vcan0", "--from", "3s")
    assert result.exit_code == 2
    assert "--from 3s is for a log; vcan0 is not a log" in result.stderr


# Nothing passes.


@pytest.mark.parametrize("verb", ["dump", "top", "conv"])
def test_a_filter_that_lets_nothing_pass_says_so_and_ends_with_1(
    verb: str, log: str, tmp_path: Path
) -> None:
    out = [tmp_path / "out.log"] * (verb == "conv")
    result = canmon(verb, log, *out, "-F", "emcy")
    assert (result.exit_code, result.stderr) == (1, "-F 'emcy': none of 10 frames passes\n")
    result = canmon(verb, f"{log},7FF:7FF", *out)
    assert result.exit_code == 1
    assert result.stderr == f"{log}: no frame passes the filter after its name\n"


def test_a_recording_of_which_the_filter_keeps_nothing_says_so(log: str, tmp_path: Path) -> None:
    result = canmon("dump", log, "-l", tmp_path / "out.log", "-F", "emcy")
    assert (result.exit_code, result.stderr) == (1, "-F 'emcy': none of 10 frames passes\n")


@pytest.mark.parametrize("verb", ["dump", "top", "conv", "stats", "nodes"])
def test_a_part_that_is_empty_says_where_the_log_lies(verb: str, log: str, tmp_path: Path) -> None:
    out = [tmp_path / "out.log"] * (verb == "conv")
    result = canmon(verb, log, *out, "--from", "2")
    assert result.exit_code == 1
    span = f"the log has 0.009 s, {DATE}.000000 to {DATE}.009000"
    assert result.stderr == f"--from 2: no frame in this part; {span}\n"


def test_a_log_without_any_frame_is_no_fault_of_its_filter(tmp_path: Path) -> None:
    empty = tmp_path / "run.log"
    empty.touch()
    result = canmon("dump", empty, "-F", "emcy", "--from", "2")
    assert (result.exit_code, result.stdout, result.stderr) == (0, "", "")
