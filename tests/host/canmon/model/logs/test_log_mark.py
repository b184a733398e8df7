"""Marks between frames, and logs whose writer was killed."""

from __future__ import annotations

import gzip
import json
from itertools import islice
from pathlib import Path

import can
import pytest

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.log_file import LogError, Mark, back, dropped, gone, triggered
from tickrig.host.canmon.model.logs.log_reader import LogReader, read_log
from tickrig.host.canmon.model.logs.log_writer import LogWriter, in_blocks, write_log
from tickrig.wire.can import CanFrame

START_US = 1_700_000_000_000_000
MARKS = (
    dropped(START_US, 12),
    gone(START_US, "can0", "can0: Network is down"),
    back(START_US + 500_000, "can0", 500_000),
    triggered(START_US, "ü\nemcy"),
)
HELD = ["run.pcapng", "run.log", "run.log.gz", "run.jsonl", "run.asc", "run.trc", "run.blf"]
LEFT_OUT = ["run.csv", "run.trace"]


def record(number: int) -> Record:
    data = number.to_bytes(8, "big")
    return Record(START_US + number * 125, "can0", CanFrame(0x181, data))


def filled(path: Path, count: int, marks: tuple[Mark, ...] = ()) -> LogWriter:
    writer = write_log(path)
    for number in range(count):
        writer.write(record(number))
        for mark in marks:
            writer.mark(mark)
    return writer


def text_of(path: Path) -> str:
    return (gzip.decompress if path.suffix == ".gz" else bytes)(path.read_bytes()).decode("latin-1")


@pytest.mark.parametrize("name", [*HELD, *LEFT_OUT])
def test_frames_stay_readable_among_marks(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    writer = filled(path, 3, MARKS)
    writer.close()
    reader = read_log(path)
    assert [one.frame for one in reader] == [record(number).frame for number in range(3)]
    assert reader.tally.unread == 0
    left_out = [word for word in writer.messages() if "12 marks of gaps and triggers" in word]
    assert bool(left_out) is (name in LEFT_OUT)


@pytest.mark.parametrize("name", ["run.log", "run.jsonl", "run.asc", "run.trc"])
def test_marks_are_words_in_the_log(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    filled(path, 1, MARKS).close()
    for word in ("12 frames were lost", "can0 is gone: Network is down", "trigger: \\xfc emcy"):
        assert (word.replace("\\", "\\\\") if name == "run.jsonl" else word) in text_of(path)


@pytest.mark.parametrize("name", ["run.log", "run.log.gz", "run.jsonl"])
def test_what_was_lost_is_counted_when_the_log_is_read(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    filled(path, 2, MARKS).close()
    reader = read_log(path)
    assert len(list(reader)) == 2
    assert reader.tally.lost == 24


def test_python_can_finds_markers_in_blf(tmp_path: Path) -> None:
    path = tmp_path / "run.blf"
    filled(path, 1, MARKS[1:2]).close()
    assert len(list(can.BLFReader(path))) == 1
    reader = read_log(path)
    assert len(list(reader)) == 1
    assert reader.tally.messages("x") == ["x: 1 objects that are no frames passed over"]


@pytest.mark.parametrize("name", ["run.asc", "run.trc", "run.blf"])
def test_a_log_may_begin_with_a_mark(name: str, tmp_path: Path) -> None:
    writer = write_log(path := tmp_path / name)
    writer.mark(MARKS[1])
    writer.write(record(8))
    writer.close()
    assert [one.at_us for one in read_log(path)] == [record(8).at_us]


def test_an_event_tells_the_bus_and_for_how_long_it_was_away() -> None:
    assert json.loads(MARKS[2].json()) == {
        "v": 1,
        "ev": "back",
        "t": 1_700_000_000.5,
        "ch": "can0",
        "away": 0.5,
        "text": "can0 is back after 0.500000 s",
    }


def readable(reader: LogReader) -> tuple[list[Record], str]:
    found: list[Record] = []
    try:
        found.extend(reader)
    except LogError as error:
        return found, str(error)
    return found, ""


@pytest.mark.parametrize(
    "name",
    [
        "run.log",
        "run.log.gz",
        "run.asc.gz",
        "run.jsonl.gz",
        "run.blf",
        "run.pcapng",
        "run.pcapng.gz",
    ],
)
def test_all_that_was_flushed_is_read_of_a_log_whose_writer_was_killed(
    name: str, tmp_path: Path
) -> None:
    writer = filled(tmp_path / name, 3_000)
    writer.flush()
    for number in range(3_000, 3_010):
        writer.write(record(number))
    killed = tmp_path / f"killed-{name}"
    killed.write_bytes((tmp_path / name).read_bytes())
    writer.close()
    found, why = readable(read_log(killed))
    assert found[:3_000] == [record(number) for number in range(3_000)]
    assert in_blocks(killed) is bool(why)
    assert in_blocks(killed) or list(islice(found, 3_000, None)) == []


def test_a_blf_log_without_its_end_says_so(tmp_path: Path) -> None:
    writer = filled(path := tmp_path / "run.blf", 5)
    writer.flush()
    _, why = readable(read_log(path))
    assert why == f"{path}: its recorder did not end it: it has 5 frames"
    writer.close()
    assert readable(read_log(path))[1] == ""
