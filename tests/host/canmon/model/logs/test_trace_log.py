from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from random import Random

import pytest

from tests.emulators.record.test_bench_replay import Bench
from tests.mutators import spoilt
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.log_file import LogError
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.model.logs.log_writer import write_log
from tickrig.wire.can import NO_ACK, CanFrame


def record(at_us: int, channel: str, text: str, *, sent: bool = False) -> Record:
    return Record(at_us, channel, CanFrame.parse(text), sent)


def test_a_bus_is_written_as_a_trace_and_read_again(tmp_path: Path) -> None:
    frames = [
        record(1_700_000_000_000_000, "can0", "705#00"),
        record(1_700_000_000_000_250, "can0", "605#4000100000000000", sent=True),
        record(1_700_000_000_900_000, "can0", "1ABBCCDD#R3"),
    ]
    writer = write_log(tmp_path / "run.trace")
    for frame in frames:
        writer.write(frame)
    writer.write(record(1_700_000_001_000_000, "can1", "701#00"))
    writer.write(Record(1_700_000_001_000_000, "can0", NO_ACK))
    writer.flush()
    writer.close()
    writer.close()
    assert (tmp_path / "run.trace").read_text() == (
        '# tickrig-trace v2 {"seed": 0, "place": "port", "wires": {"bus": {"type": "can"}},'
        ' "devices": {"can0": {"wire": "bus"}}}\n'
        "0.000000 can0 < 705#00\n"
        "0.000250 can0 > 605#4000100000000000\n"
        "0.900000 can0 < 1ABBCCDD#R3\n"
        "0.900000 .\n"
    )
    assert writer.messages() == [
        "run.trace: a trace holds one bus, without errors; left out: 1 frames of other buses",
        "run.trace: a trace holds one bus, without errors; left out: 1 error frames",
    ]
    begin_us = frames[0].at_us
    moved = [frame._replace(at_us=frame.at_us - begin_us) for frame in frames]
    assert list(read_log(tmp_path / "run.trace")) == moved


def test_a_bus_without_frames_is_an_empty_file(tmp_path: Path) -> None:
    write_log(tmp_path / "run.trace").close()
    assert (tmp_path / "run.trace").read_text() == ""


@pytest.fixture(scope="module")
def bench() -> bytes:
    bench = Bench()
    bench.rig.run_for(5_000)
    bench.send("000#0100", "603#4000600100000000")
    bench.line.b.send(bench.rig.now_us, b"version\n")
    bench.rig.run_for(25_000)
    return bench.trace


def test_the_frames_of_a_bench_are_read_once_each(tmp_path: Path, bench: bytes) -> None:
    (tmp_path / "run.trace").write_bytes(bench)
    log = read_log(tmp_path / "run.trace")
    frames = list(log)
    assert {frame.channel for frame in frames} == {"can"}
    texts = [str(frame.frame) for frame in frames]
    assert texts[:7] == ["701#00", "702#00", "703#00", "704#00", "705#00", "000#0100",
                         "603#4000600100000000"]  # fmt: skip
    assert [str(frame.frame) for frame in frames if frame.sent] == texts[5:7]
    assert "583#4F00600100000000" in texts
    assert log.tally.passed_over == {"lines of a serial port": 3}


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"hello\n", "line 1 is not"),
        (b"\xff\n", "it is not ASCII"),
        (b"# tickrig-trace v1 rrc {}\n", "line 1 is not '# tickrig-trace v2"),
    ],
)
def test_what_is_no_trace_is_said(tmp_path: Path, data: bytes, message: str) -> None:
    (tmp_path / "run.trace").write_bytes(data)
    with pytest.raises(LogError, match=message):
        list(read_log(tmp_path / "run.trace"))


def test_any_damage_is_a_log_error(tmp_path: Path, bench: bytes) -> None:
    chance = Random(1)
    for _ in range(300):
        (tmp_path / "run.trace").write_bytes(spoilt(bench, chance))
        with suppress(LogError):
            list(read_log(tmp_path / "run.trace"))
