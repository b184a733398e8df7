"""What a new user does wrong, and what a machine does to him: one line each, and no traceback."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tests.host.canmon.model.decode.drive_trace import GOLDEN
from tickrig.host.canmon.cli import main

PROGRAM = (sys.executable, "-c", "from tickrig.host.canmon.cli import main; main()")
DRIVE = str(GOLDEN / "drive.log")
PATIENCE_S = 30


def canmon(*words: str) -> Result:
    return CliRunner().invoke(main, words)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("words", [["dump", DRIVE], ["info", DRIVE]])
def test_a_full_disk_is_said_in_one_line(words: list[str]) -> None:
    with Path("/dev/full").open("wb") as full:
        ran = subprocess.run(
            [*PROGRAM, *words],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )
    assert (ran.returncode, ran.stderr) == (
        3,
        "Error: standard output: No space left on device\n",
    )


@pytest.mark.parametrize("words", [["info", DRIVE], ["graph", DRIVE, "185[0]"]])
def test_a_pipe_that_nobody_reads_ends_it_quietly(words: list[str]) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    ran = subprocess.run(
        [*PROGRAM, *words],
        stdout=writing,
        stderr=subprocess.PIPE,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    os.close(writing)
    assert (ran.returncode, ran.stderr) == (0, "")


@pytest.mark.parametrize("verb", [["dump"], ["top"], ["nodes"], ["stats"], ["check", "--no-emcy"]])
def test_an_empty_file_of_a_binary_format_is_said_to_be_empty(
    tmp_path: Path, verb: list[str]
) -> None:
    path = tmp_path / "run.blf"
    path.touch()
    result = canmon(*verb, str(path))
    assert result.exit_code == 3
    assert result.stderr == f"Error: {path} is no blf log: it is empty\n"


@pytest.mark.parametrize("name", ["run.log", "run.trc"])
def test_lines_of_noise_are_shown_in_ascii_by_canmon_alone(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(b"7 \xff\xfe 705#\n" * 3)
    ran = subprocess.run(
        [*PROGRAM, "dump", str(path)],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert ran.stdout == ""
    assert ran.stderr.isascii()
    assert all(line.startswith((f"{path}: ", "Error: ")) for line in ran.stderr.splitlines())


@pytest.mark.parametrize(
    "word", ["08", "0128", "0", "0x80", "0x", "1e1", "-1", "1_0", "٣", "9" * 99]
)
def test_a_node_id_is_read_in_decimal_or_told_to_be_none(tmp_path: Path, word: str) -> None:
    result = canmon("dump", DRIVE, "--eds", f"{word}={tmp_path / 'x.eds'}")
    wrong = f"--eds '{word}={tmp_path}/x.eds' is not NODE=FILE with a node-ID 1..127"
    said = f"--eds {tmp_path}/x.eds: No such file" if word == "08" else wrong
    assert (result.exit_code, said in result.stderr) == (2, True), result.stderr
