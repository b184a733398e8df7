from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.monitor.logs.test_log_lines import FRAMES
from tickrig.host.canmon.output.printer import csv_printer
from tickrig.host.monitor.frames.record import Record
from tickrig.host.monitor.logs.can_record import to_record
from tickrig.host.monitor.logs.log_reader import LogLines, read_log
from tickrig.host.monitor.logs.log_writer import write_log
from tickrig.host.monitor.logs.notation import DUMP_HEADER
from tickrig.host.monitor.logs.tally import Tally
from tickrig.wire.can import CanFrame
from tickrig.wire.can_fd import FdFrame

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
        assert (list(reader), reader.tally) == (records, Tally())
        with can.CSVReader(path) as foreign:
            theirs = [to_record(message, "can0", Tally()) for message in foreign]
    assert len(theirs) == len(records)
    for their, ours in zip(theirs, records, strict=True):
        if not isinstance(ours.frame, FdFrame):  # which python-can's rows do not tell
            assert their == ours._replace(sent=False)


@given(records=HEARDS)
def test_what_dump_prints_as_csv_is_read_again(records: list[Record]) -> None:
    rows = [DUMP_HEADER, *(csv_printer(record, None) for record in records)]
    lines = LogLines()
    assert lines.push("".join(f"{row}\n" for row in rows).encode()) == records
    assert lines.tally == Tally()


def test_buses_that_become_one_are_said(tmp_path: Path) -> None:
    writer = write_log(tmp_path / "run.csv")
    for name in ("can0", "can1"):
        writer.write(Record(0, name, CanFrame(1)))
    writer.close()
    assert writer.messages() == ["run.csv: csv does not tell buses apart: can0, can1"]


def test_lines_of_a_serial_port_are_counted() -> None:
    lines = LogLines()
    assert not lines.push(b'1.500000,ttyS0,,rx,2,5341,rrc,,"SA, 64"\n')
    assert lines.tally == Tally(passed_over=lines.tally.passed_over)
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
