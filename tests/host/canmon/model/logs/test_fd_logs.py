"""CAN FD in every format: what is written is read again, and python-can reads the same."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path

import can
import pytest

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.can_log import to_can
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.model.logs.log_writer import write_log
from tickrig.host.links.can_link import to_fd_frame, to_frame
from tickrig.wire.can import FD_LENGTHS, CanFrame, FdFrame

START_US = 1_700_000_000_000_000
READERS: dict[str, Callable[[Path], can.io.generic.MessageReader]] = {
    "run.log": can.CanutilsLogReader,
    "run.asc": lambda path: can.ASCReader(path, relative_timestamp=False),
    "run.blf": can.BLFReader,
    "run.trc": can.TRCReader,
}


def mixed() -> list[Record]:
    """Return frames of each length with each flag, classic ones among them."""
    chance, records = random.Random(18), list[Record]()
    for length in FD_LENGTHS:
        for flags in range(4):
            extended = chance.random() < 0.5
            can_id = chance.randrange(1 << (29 if extended else 11))
            frame = FdFrame(can_id, chance.randbytes(length), extended, flags)
            at_us = START_US + 1_000 * len(records) + chance.randrange(1_000)
            records.append(Record(at_us, "can1", frame, chance.random() < 0.3))
            frame_too = CanFrame(chance.randrange(0x800), chance.randbytes(length % 9))
            records.append(Record(at_us, "can0", frame_too))
    return records


def written(path: Path, records: list[Record]) -> list[str]:
    log = write_log(path)
    for record in records:
        log.write(record)
    log.close()
    return log.messages()


@pytest.mark.parametrize(
    "name", ["run.log", "run.jsonl.gz", "run.asc", "run.asc.gz", "run.blf", "run.trc"]
)
def test_all_of_can_fd_is_read_again(name: str, tmp_path: Path) -> None:
    assert written(tmp_path / name, mixed()) == []
    reader = read_log(tmp_path / name)
    assert list(reader) == mixed()
    assert (reader.tally.unread, reader.tally.passed_over) == (0, {})


@pytest.mark.parametrize("name", READERS)
def test_python_can_reads_the_same_frames(name: str, tmp_path: Path) -> None:
    written(tmp_path / name, mixed())
    frames = [
        (message.is_rx, to_frame(message) or to_fd_frame(message))
        for message in READERS[name](tmp_path / name)
    ]
    assert frames == [(not one.sent, one.frame) for one in mixed()]


@pytest.mark.parametrize(
    ("name", "writer"),
    [
        ("run.log", can.CanutilsLogWriter),
        ("run.asc", can.ASCWriter),
        ("run.blf", can.BLFWriter),
    ],
)
def test_what_python_can_writes_is_read(
    name: str, writer: Callable[[Path], can.io.generic.MessageWriter], tmp_path: Path
) -> None:
    log = writer(tmp_path / name)
    for record in mixed():
        log.on_message_received(to_can(record, int(record.channel[-1])))
    log.stop()
    read = list(read_log(tmp_path / name))
    channels = [one.channel[-1] for one in mixed()]
    assert [one.frame for one in read] == [one.frame for one in mixed()]
    assert [one.sent for one in read] == [one.sent for one in mixed()]
    assert [one.channel[-1] for one in read] == channels


def test_csv_holds_can_fd_and_python_can_the_data_of_it(tmp_path: Path) -> None:
    records = [one._replace(channel="can0") for one in mixed()]
    assert written(tmp_path / "run.csv", records) == []
    assert list(read_log(tmp_path / "run.csv")) == records
    messages = list(can.CSVReader(tmp_path / "run.csv"))
    assert [bytes(one.data) for one in messages] == [one.frame.data for one in records]


def test_rows_of_python_can_with_more_than_eight_bytes_are_can_fd(tmp_path: Path) -> None:
    log = can.CSVWriter(tmp_path / "run.csv")
    log.on_message_received(to_can(Record(0, "can0", FdFrame(0x123, bytes(12))), 0))
    log.stop()
    assert [one.frame for one in read_log(tmp_path / "run.csv")] == [FdFrame(0x123, bytes(12))]


def test_a_trace_of_a_rig_holds_no_can_fd_and_says_so(tmp_path: Path) -> None:
    said = written(tmp_path / "run.trace", [Record(0, "can0", FdFrame(1))])
    assert said == ["run.trace: a trace holds one bus, without errors; left out: 1 CAN FD frames"]


def test_a_name_of_a_bus_is_no_longer_than_a_log_holds(tmp_path: Path) -> None:
    head = "date Fri Jul 10 06:17:32 AM 2015\nbase hex\ninternal events logged\n"
    text = f"{head}   0.1 {'9' * 40}  705  Rx   d 1 7F\n"
    (tmp_path / "run.asc").write_text(text)
    (record,) = read_log(tmp_path / "run.asc")
    assert len(record.channel) == 32
    written(tmp_path / "run.log", [record])
    assert list(read_log(tmp_path / "run.log")) == [record]
