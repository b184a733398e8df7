from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tests.host.canmon.model.decode.drive_trace import TRACE
from tests.host.canmon.terminal import PROGRAM
from tickrig.host.canmon.cli import main
from tickrig.host.canmon.sources import source as block_log

EPOS = Path(__file__).parents[4] / "examples" / "eds" / "epos.eds"


def nodes(*words: str) -> Result:
    return CliRunner().invoke(main, ["nodes", *words])


def test_of_a_log_file_the_final_state_is_shown() -> None:
    result = nodes(str(TRACE))
    assert result.exit_code == 0, result.output
    head, row, *_ = result.stdout.splitlines()
    assert head.split("  ")[0] == "NODE"
    assert row.split()[:5] == ["5", "EPOS", "pre-operational", "->", "stopped"]


def test_a_large_log_has_the_same_board(monkeypatch: pytest.MonkeyPatch) -> None:
    words = [str(TRACE), "--eds", f"7={EPOS}", "--jsonl"]
    small = nodes(*words)
    monkeypatch.setattr(block_log, "SMALL_BYTES", 0)
    large = nodes(*words)
    assert (large.stdout, large.stderr, large.exit_code) == (small.stdout, small.stderr, 0)


@pytest.mark.parametrize("size", [0, 1 << 20])
def test_two_nodes_with_one_node_id_are_marked_and_have_no_period(
    size: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(block_log, "SMALL_BYTES", size)
    log = tmp_path / "run.log"
    times = sorted([n * 75 for n in range(9)] + [20 + n * 75 for n in range(9)])
    beats = [f"({1_000 + ms / 1e3:.6f}) can0 705#05\n" for ms in times]
    log.write_text("".join(beats), "ascii")
    (found,) = map(json.loads, nodes(str(log), "--jsonl").stdout.splitlines())
    assert (found["doubled"], found["heartbeat_ms"], found["late"]) == (True, None, False)
    assert "from two nodes" in nodes(str(log)).stdout
    log.write_text("".join(beats[::2]), "ascii")
    (found,) = map(json.loads, nodes(str(log), "--jsonl").stdout.splitlines())
    assert (found["doubled"], found["heartbeat_ms"]) == (False, 75)
    log.write_text("(1.0) can0 705#05\n(2.0) can0 705#00\n(2.01) can0 705#00\n", "ascii")
    (found,) = map(json.loads, nodes(str(log), "--jsonl").stdout.splitlines())
    assert found["doubled"]


def test_each_node_is_a_json_object() -> None:
    result = nodes(str(TRACE), "--jsonl")
    (found,) = map(json.loads, result.stdout.splitlines())
    assert (found["v"], found["node"], found["boots"], found["unasked_boots"]) == (1, 5, 2, 0)
    assert [emcy["code"] for emcy in found["emcy"]] == [0x8210]


def test_without_nodes_there_is_no_json(tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    path.write_text("(1.000000) can0 7FF#00\n")
    assert nodes(str(path), "--jsonl").stdout == ""
    assert nodes(str(path)).stdout == "no node has sent a frame\n"


def test_standard_input_is_read_to_its_end() -> None:
    said = "(1.000000) can0 705#05\n(1.100000) can0 705#05\n"
    words = [sys.executable, "-c", PROGRAM, "nodes", "-", "--jsonl"]
    result = subprocess.run(words, input=said, capture_output=True, text=True, check=True)
    assert json.loads(result.stdout)["state"] == "operational"


def test_an_eds_puts_its_node_on_the_board() -> None:
    result = nodes(str(TRACE), "--eds", f"0x7={EPOS}")
    assert result.stdout.splitlines()[2].split() == ["7", "EPOS", "(EDS)", "?", "->", "stopped"]


NO_WORD = "is not NODE=FILE with a node-ID 1..127, as 3=drive.eds or 1-3=drive.eds"


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (
            ("--eds", "200=x"),
            f"--eds '200=x' {NO_WORD}",
        ),
        (("--eds", "x"), f"--eds 'x' {NO_WORD}"),
        (("--eds", "5=none.eds"), "--eds none.eds: No such file or directory"),
        (("--for", "soon"), "--for 'soon' is not a time: write 1.5s, 200ms or 250us"),
    ],
)
def test_a_mistake_is_one_line(words: tuple[str, ...], text: str) -> None:
    result = nodes(str(TRACE), *words)
    assert (result.exit_code, result.stderr) == (2, f"Error: {text}\n")


def test_a_file_that_is_no_eds_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "bad.eds"
    path.write_text("no EDS at all")
    result = nodes(str(TRACE), "--eds", f"5={path}")
    assert result.exit_code == 2
    assert result.stderr == f"Error: --eds {path}: has no objects (no-objects)\n"


def test_the_help_shows_examples_and_sources() -> None:
    result = nodes("--help")
    assert "canmon nodes can0 --eds 3=drive.eds --for 5s --jsonl" in result.output
    assert "slcan:/dev/ttyACM0@500k" in result.output


def test_lost_frames_end_a_strict_run(tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    path.write_text('{"v":1,"ev":"drop","n":12}\n', "ascii")
    assert nodes(str(path), "--strict").exit_code == 4
