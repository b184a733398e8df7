from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.host.canmon.cli import main
from tickrig.host.canmon.sources import source as block_log

LOG = "(1.000000) can0 181#00\n(1.100000) can0 181#01\n(1.150000) can0 701#05\n"


def top(*words: str, text: str | None = None) -> Result:
    return CliRunner().invoke(main, ["top", *words], input=text)


def test_a_log_file_ends_with_the_table(log: str) -> None:
    result = top(log)
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[0].startswith("can0: 3 frames, load 1.2 kbit/s,")
    assert result.stdout.splitlines()[3].split() == [
        *("181", "2", "10.00", "100.000", "100.000", "100.000"),
        *("100.000", "100.000", "0.000", "0", "0.1", "01"),
    ]


def test_a_large_log_has_the_same_table(log: str, monkeypatch: pytest.MonkeyPatch) -> None:
    small = top(log).stdout
    monkeypatch.setattr(block_log, "SMALL_BYTES", 0)
    assert top(log).stdout == small


MAPPING = "(0.5) can0 581#4F001A0001000000\n(0.6) can0 581#43001A0110004160\n"


def test_what_frames_mean_is_shown(tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    path.write_text(MAPPING + "(1.0) can0 181#3802\n(1.1) can0 7FF#00\n", "ascii")
    lines = top(str(path), "-d").stdout.splitlines()
    assert lines[2].endswith("meaning")
    assert lines[3].endswith("1 tpdo1 statusword=0x0238[fault] (seen)")
    assert lines[-1].endswith(" raw")


def test_frames_that_are_not_wanted_are_not_counted(log: str) -> None:
    result = top(log, "-F", "heartbeat")
    assert result.stdout.startswith("can0: 1 frames")
    assert result.stdout.splitlines()[-1].endswith(" 05")


def test_the_load_is_a_share_of_the_bit_rate(log: str) -> None:
    assert "mean 11.6 %" in top(log, "-b", "10000").stdout


def test_the_help_shows_examples_and_sources() -> None:
    result = CliRunner().invoke(main, ["top", "--help"])
    assert "canmon top run.log" in result.output
    assert "slcan:/dev/ttyACM0@500k" in result.output


def test_a_line_that_is_no_frame_is_told(tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    path.write_text(LOG + "what?\n", "ascii")
    result = top(str(path))
    assert result.exit_code == 0
    assert "line 4 is no frame: 'what?'" in result.stderr


def test_lost_frames_are_shown_and_end_a_strict_run(tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    path.write_text('{"v":1,"ev":"drop","n":12}\n', "ascii")
    assert top(str(path)).exit_code == 0
    result = top(str(path), "--strict")
    assert "lost 12" in result.stdout
    assert (result.exit_code, result.stderr.splitlines()[-1]) == (4, "Error: 12 frames were lost")


@pytest.mark.parametrize(
    ("words", "status", "reason"),
    [
        ((), 2, "no SOURCE: name a bus as can0, a log file as run.log, or - for standard input"),
        (("none.log",), 3, "none.log: No such file or directory"),
        (
            ("none.log", "--for", "soon"),
            2,
            "--for 'soon' is not a time: write 1.5s, 200ms or 250us",
        ),
    ],
)
def test_what_cannot_be_done_is_said_in_a_line(
    words: tuple[str, ...], status: int, reason: str
) -> None:
    result = top(*words)
    assert (result.exit_code, result.stderr) == (status, f"Error: {reason}\n")
