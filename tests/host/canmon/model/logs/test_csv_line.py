from __future__ import annotations

import gzip
from pathlib import Path
from tempfile import TemporaryDirectory

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.logs.test_log_lines import FRAMES
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.can_log import to_record
from tickrig.host.canmon.model.logs.log_file import LogTally, dropped
from tickrig.host.canmon.model.logs.log_reader import LogLines, read_log
from tickrig.host.canmon.model.logs.log_writer import log_line, write_log
from tickrig.host.canmon.model.logs.notation import DUMP_HEADER
from tickrig.host.canmon.output.printer import csv_printer
from tickrig.wire.can import CanFrame, ErrorFrame, FdFrame

HEARDS = st.lists(
    st.builds(Record, st.integers(0, 4 * 10**15), st.just("can0"), FRAMES, st.booleans())
)


@given(records=HEARDS)
def test_csv_holds_a_bus_with_who_sent_and_python_can_reads_it(records: list[Record]) -> None:
    with TemporaryDirectory() as folder:
        writer = write_log(path := Path(folder, "run.csv"))
        for record in records:
            writer.write(record)
        writer.close()
        reader = read_log(path)
        assert (list(reader), reader.tally) == (records, LogTally())
        with can.CSVReader(path) as foreign:
            theirs = [to_record(message, "can0", LogTally()) for message in foreign]
    assert len(theirs) == len(records)
    for their, ours in zip(theirs, records, strict=True):
        if not isinstance(ours.frame, FdFrame):  # which python-can's rows do not tell
            assert their == ours._replace(sent=False)


@given(records=HEARDS)
def test_what_dump_prints_as_csv_is_read_again(records: list[Record]) -> None:
    rows = [DUMP_HEADER, *(csv_printer(record, None) for record in records)]
    lines = LogLines()
    assert lines.push("".join(f"{row}\n" for row in rows).encode()) == records
    assert lines.tally == LogTally()


def test_buses_that_become_one_are_said(tmp_path: Path) -> None:
    writer = write_log(tmp_path / "run.csv")
    for name in ("can0", "can1"):
        writer.write(Record(0, name, CanFrame(1)))
    writer.close()
    assert writer.messages() == ["run.csv: csv does not tell buses apart: can0, can1"]


def test_lines_of_a_serial_port_are_counted() -> None:
    lines = LogLines()
    assert not lines.push(b'1.500000,ttyS0,,rx,2,5341,rrc,,"SA, 64"\n')
    assert lines.tally == LogTally(passed_over=lines.tally.passed_over)
    assert lines.tally.passed_over == {"lines of a serial port": 1}


@pytest.mark.parametrize(
    "row",
    [
        "1.5,0x800,0,0,0,0,",
        "1.5,0x705,0,0,0,1,f",
        "1.5,0x705,0,0,0,x,",
        "1.5,705,0,0,0,9,AAECAwQFBgcI",
        "1.500000,can0,800,rx,0,,,,",
        "1.500000,can0,705,rx,1,7,,,",
    ],
)
def test_other_rows_are_bad(row: str) -> None:
    lines = LogLines()
    assert not lines.push(f"{row}\n".encode())
    assert lines.tally.bad_lines.first == [(1, row)]


GVRET = """\
Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8
166064000,0000021A,false,Rx,0,8,FE,36,12,FE,69,05,07,AD,
166065000,18FF1234,true,Tx,1,2,01,02,00,00,00,00,00,00,
166065000,18FF1234,false,Rx,1,0,00,00,00,00,00,00,00,00,
"""
OLD_GVRET = """\
Time Stamp,ID,Extended,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8
166064000,0000021A,false,0,8,FE,36,12,FE,69,05,07,AD,
166065000,0000027A,false,2,3,30,30,0D
"""


def read_csv(folder: Path, text: str, name: str = "run.csv") -> tuple[list[str], LogTally]:
    (folder / name).write_text(text, "ascii")
    reader = read_log(folder / name)
    return [log_line(record) for record in reader], reader.tally


@pytest.mark.parametrize("name", ["run.csv", "run.gvret.csv", "run.csv.gz"])
def test_logs_of_savvycan_are_told_by_their_rows(name: str, tmp_path: Path) -> None:
    text = GVRET.replace("\n", "\r\n")
    if name.endswith(".gz"):
        (tmp_path / name).write_bytes(gzip.compress(text.encode()))
        read = [log_line(record) for record in read_log(tmp_path / name)]
    else:
        read, tally = read_csv(tmp_path, text, name)
        assert tally.messages(name) == []
    assert read == [
        "(0000000166.064000) can0 21A#FE3612FE690507AD",
        "(0000000166.065000) can1 18FF1234#0102 T",
        "(0000000166.065000) can1 18FF1234#",
    ]


def test_older_ones_have_no_direction(tmp_path: Path) -> None:
    assert read_csv(tmp_path, OLD_GVRET)[0] == [
        "(0000000166.064000) can0 21A#FE3612FE690507AD",
        "(0000000166.065000) can2 27A#30300D",
    ]


@pytest.mark.parametrize(
    ("stamps", "times", "shift_us"),
    [
        ((-500_000, -400_000, 0, 250_000), (0, 100_000, 500_000, 750_000), 500_000),
        ((2**31 - 10, -(2**31) + 10), (2**31 - 10, 2**31 + 10), 2**32),
        ((2**32 - 10, 10, 20), (2**32 - 10, 2**32 + 10, 2**32 + 20), 2**32),
        ((100, 90, 200), (100, 90, 200), 0),
        ((-5, -10), (0, 0), 5),
    ],
)
def test_times_below_0_and_counters_that_overflow_go_on(
    stamps: tuple[int, ...], times: tuple[int, ...], shift_us: int, tmp_path: Path
) -> None:
    head, *_ = GVRET.splitlines()
    rows = [f"{stamp},00000705,false,Rx,0,1,7F,00,00,00,00,00,00,00," for stamp in stamps]
    read, tally = read_csv(tmp_path, "\n".join([head, *rows, ""]))
    assert [round(float(line[1:18]) * 1e6) for line in read] == list(times)
    why = "they begin below 0, or their counter overflows"
    moved = f"x: {shift_us} us were added to its times: {why}"
    assert tally.messages("x") == ([moved] if shift_us else [])


@pytest.mark.parametrize(
    "row",
    [
        "166064000,0000021A,false,Rx,0,8,FE,36,12,FE,69,05,07,",
        "166064000,0000021A,false,Rx,0,64,FE,36,12,FE,69,05,07,AD,",
        "166064000,0000021A,maybe,Rx,0,1,FE,",
        "166064000,0000021A,false,Up,0,1,FE,",
        "166064000,0000021G,false,Rx,0,1,FE,",
        "166064000,3000021A,true,Rx,0,1,FE,",
        "166064000,0000021A,false,Rx,0,1,FFF,",
        "166064000,0000021A,false,Rx,0,1,\u0661\u0661,",
    ],
)
def test_rows_of_savvycan_that_are_wrong_are_bad(row: str) -> None:
    lines = LogLines()
    assert not lines.push(f"{row}\n".encode("latin-1", "replace"))
    assert lines.tally.bad_lines.count == 1


def test_what_is_written_is_read_by_the_rules_of_savvycan(tmp_path: Path) -> None:
    writer = write_log(tmp_path / "run.gvret.csv")
    for record in (
        Record(166_064_000, "can0", CanFrame.parse("21A#FE3612FE690507AD")),
        Record(166_065_000, "vcan7", CanFrame.parse("18FF1234#0102"), sent=True),
        Record(166_065_000, "vcan7", CanFrame.parse("705#R")),
        Record(166_065_000, "vcan7", FdFrame(1)),
        Record(166_065_000, "vcan7", ErrorFrame(0x88)),
        Record(166_065_000, "vcan7", CanFrame.parse("18FF1234#")),
    ):
        writer.write(record)
    writer.mark(dropped(0, 3))
    writer.close()
    text = (tmp_path / "run.gvret.csv").read_text("ascii")
    assert text == GVRET.replace("18FF1234,false,Rx", "18FF1234,true,Rx")
    assert writer.messages() == [
        "run.gvret.csv: 1 remote frames left out",
        "run.gvret.csv: 1 CAN FD frames left out",
        "run.gvret.csv: 1 error frames left out",
        "run.gvret.csv: 1 marks of gaps and triggers left out",
        "run.gvret.csv: vcan7 became can1",
    ]


@pytest.mark.parametrize("name", ["run.gvret.csv", "run.gvret.csv.gz"])
@given(data=st.data())
def test_data_frames_go_through_a_log_of_savvycan(name: str, data: st.DataObject) -> None:
    frames = st.builds(
        lambda can_id, data, long: CanFrame(can_id << 18 if long else can_id, data, False, long),
        st.integers(0, 0x7FF),
        st.binary(max_size=8),
        st.booleans(),
    )
    rising = st.lists(st.integers(0, 10**15), min_size=1).map(sorted)
    times = data.draw(rising)
    buses = st.sampled_from(["can0", "can3"])
    records = [
        Record(at_us, data.draw(buses), data.draw(frames), at_us % 2 == 0) for at_us in times
    ]
    with TemporaryDirectory() as folder:
        writer = write_log(path := Path(folder, name))
        for record in records:
            writer.write(record)
        writer.close()
        assert list(read_log(path)) == records
        assert writer.messages() == []
