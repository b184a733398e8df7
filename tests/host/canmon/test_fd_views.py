"""CAN FD with the verbs that show it, from a small log and from one that is read in blocks."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tickrig.host.canmon.cli import main
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.trace import FrameTrace
from tickrig.host.canmon.sources import source as block_log
from tickrig.host.canmon.tui.panels.trace_panel import TraceLines, line_text
from tickrig.wire.can import FdFrame

WIDE = "00" * 63
LOG = "".join(
    f"(1.{n:06d}) can0 123##1{WIDE}{n % 256:02X}\n(1.{n:06d}) can0 123#{n % 256:02X}\n"
    for n in range(0, 3_000, 10)
)


@pytest.fixture(params=["frame by frame", "in blocks"])
def log(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(block_log, "SMALL_BYTES", 0 if request.param == "in blocks" else 1 << 20)
    path = tmp_path / "run.log"
    path.write_text(LOG)
    return path


def canmon(*words: object) -> Result:
    return CliRunner().invoke(main, [str(word) for word in words])


def test_stats_have_a_row_for_each_kind(log: Path) -> None:
    result = canmon("stats", log, "--jsonl")
    bus, classic, fd = map(json.loads, result.stdout.splitlines())
    assert (bus["n"], bus["fd"], bus["fd_unrated"]) == (600, 300, 300)
    assert (classic["n"], fd["n"], fd["fd"], len(fd["changes"])) == (300, 300, 1, 512)


def test_top_and_check_and_graph_take_all_of_it(log: Path, tmp_path: Path) -> None:
    assert "can0: 600 frames" in canmon("top", log).stdout
    unknown = canmon("check", log, "--known", "123")
    assert (unknown.exit_code, unknown.stdout.count("123# is not expected")) == (1, 1)
    assert canmon("check", log, "--known", "123,123#").exit_code == 0
    assert canmon("graph", log, "123[63]", "-o", tmp_path / "g.csv").exit_code == 0
    rows = (tmp_path / "g.csv").read_text().splitlines()
    assert rows[:3] == ["t_s,123[63]", "1.000000,0", "1.000010,10"]
    assert len(rows) == 301


def test_info_and_dump_tell_of_it(log: Path) -> None:
    assert "frames   600" in canmon("info", log).stdout
    first = canmon("dump", log, "-n", "1", "-t", "z").stdout
    shown = " ".join(["00"] * 64)
    assert first == f" (000.000000)  can0  123  [64]  {shown}   fd no CANopen service\n"


def test_the_trace_of_the_tui_shows_64_bytes_and_what_changed() -> None:
    trace, lines = FrameTrace(), TraceLines()
    trace.take(Record(0, "can0", FdFrame(0x123, bytes(64))))
    line = lines.line(trace.take(Record(1_000, "can0", FdFrame(0x123, bytes(63) + b"\x01"))))
    assert line_text(line).split()[2:4] == ["123#", "[64]"]
    assert [text.strip() for text, style in line if style.startswith("bold yellow")] == ["01"]
