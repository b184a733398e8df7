"""ASC logs with any header, any kind of times and all that stands between the frames."""

from __future__ import annotations

import shutil
import subprocess
from datetime import datetime
from pathlib import Path

import can
import pytest

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.log_reader import read_log

DATE = "date Fri Jul 10 06:17:32.249 AM 2015\n"
START_US = round(datetime(2015, 7, 10, 6, 17, 32, 249_000).timestamp() * 1e6)
HEX = "base hex  timestamps absolute\n"
BEATS = "".join(f"   0.{n}00000 1  705             Rx   d 1 7F\n" for n in (1, 2, 3))


def log(folder: Path, text: str) -> Path:
    path = folder / "run.asc"
    path.write_text(text, "utf-8")
    return path


def read(folder: Path, text: str) -> list[Record]:
    return list(read_log(log(folder, text)))


@pytest.mark.parametrize(
    "head",
    [
        "",
        DATE,
        DATE + HEX,
        DATE + "base hex\n",
        DATE + HEX + "// CAN channel: 1 2\nBegin Triggerblock\n",
        DATE + HEX + "internal events logged\n",
        DATE + HEX + "no internal events logged\n// version 7.1.0\n",
        "\n\n" + DATE + HEX,
        "\ufeff" + DATE.replace("\n", "\r\n") + HEX,
        DATE + HEX + "   0.000000 Start of measurement\n",
        "// written by a script\n" + HEX,
    ],
)
def test_no_header_costs_a_frame(head: str, tmp_path: Path) -> None:
    reader = read_log(log(tmp_path, head + BEATS))
    records = list(reader)
    start_us = START_US if "date" in head else 0
    assert [record.at_us - start_us for record in records] == [100_000, 200_000, 300_000]
    assert reader.tally.messages("run.asc") == []


@pytest.mark.parametrize(
    ("date", "moment"),
    [
        ("Wed May 30 1:29:58 pm 2012", datetime(2012, 5, 30, 13, 29, 58)),
        ("Fri Jul 10 12:17:32 am 2015", datetime(2015, 7, 10, 0, 17, 32)),
        ("Mit Mär 4 23:05:00.5 2020", datetime(2020, 3, 4, 23, 5, 0, 500_000)),
        ("Don Mai 27 04:09:35.000001 2014", datetime(2014, 5, 27, 4, 9, 35, 1)),
        ("Mon Okt 5 04:09:35 2020", datetime(2020, 10, 5, 4, 9, 35)),
        ("Dez 24 04:09:35 2020", datetime(2020, 12, 24, 4, 9, 35)),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_dates_are_read_in_english_and_german(
    date: str, moment: datetime, encoding: str, tmp_path: Path
) -> None:
    (tmp_path / "run.asc").write_text(f"date {date}\n{BEATS}", encoding)
    first, *_ = read_log(tmp_path / "run.asc")
    assert first.at_us - 100_000 == round(moment.timestamp() * 1e6)


def test_a_date_may_be_that_of_greenwich(tmp_path: Path) -> None:
    first, *_ = read(tmp_path, "date Sun May 26 19:15:02 UTC 2019\n" + BEATS)
    assert first.at_us == 1_558_898_102_100_000


@pytest.mark.parametrize(
    "date", ["yesterday", "Fri Foo 10 06:17:32 2015", "Fri Jul 40 6:17:32 2015"]
)
def test_a_date_that_is_none_is_said_and_times_begin_at_0(date: str, tmp_path: Path) -> None:
    reader = read_log(log(tmp_path, f"date {date}\n{BEATS}"))
    assert [record.at_us for record in reader] == [100_000, 200_000, 300_000]
    assert reader.tally.messages("x") == ["x: its date cannot be read: times begin at 0"]


RELATIVE = DATE + "base hex  timestamps relative\ninternal events logged\n"


def test_relative_times_are_added_up(tmp_path: Path) -> None:
    beat = "   0.100000 1  705             Rx   d 1 7F\n"
    text = RELATIVE + "   0.000000 Start of measurement\n" + 3 * beat
    text += "   0.050000 1  Statistic: D 0 R 0 XD 0 XR 0 E 0 O 0 B 0.00%\n" + beat
    text += "   0.000001 CANFD   1 Rx  123   1 0 1 1 AA  0 0 1000 0 0 0 0 0\n   0.5 2 ErrorFrame\n"
    spans = [one.at_us - START_US for one in read(tmp_path, text)]
    assert spans == [100_000, 200_000, 300_000, 450_000, 450_001, 950_001]


@pytest.mark.skipif(not shutil.which("asc2log"), reason="no asc2log: apt-get install can-utils")
def test_relative_times_are_those_of_asc2log(tmp_path: Path) -> None:
    beats = "".join(f"   0.0{n}0000 1  705             Rx   d 1 {n:02X}\n" for n in (1, 2, 3, 4))
    path = log(tmp_path, RELATIVE + beats)
    words = ["asc2log", "-I", str(path), "-O", str(tmp_path / "run.log")]
    subprocess.run(words, check=True, stderr=subprocess.DEVNULL)
    theirs, ours = list(read_log(tmp_path / "run.log")), list(read_log(path))
    assert [one.frame for one in theirs] == [one.frame for one in ours]
    spans = [[one.at_us - records[0].at_us for one in records] for records in (theirs, ours)]
    assert spans[0] == spans[1] == [0, 20_000, 50_000, 90_000]


def test_each_session_of_a_log_has_its_date(tmp_path: Path) -> None:
    again = DATE.replace("06:17:32.249 AM", "06:20:32 AM")
    text = f"{DATE}{HEX}{BEATS}End TriggerBlock\n\n{again}{HEX}{BEATS}End TriggerBlock\n"
    records = read(tmp_path, text)
    assert records[3].at_us - records[0].at_us == 179_751_000


@pytest.mark.parametrize(("time", "span_us"), [("0.500000", 10_500_000), ("10.500000", 10_500_000)])
def test_times_in_a_trigger_block_count_from_it_or_from_the_header(
    time: str, span_us: int, tmp_path: Path
) -> None:
    block = "Begin Triggerblock Fri Jul 10 06:17:42.249 AM 2015\n"
    frame = f"  {time} 1  705             Rx   d 1 7F\n"
    (record,) = read(tmp_path, DATE + HEX + block + frame)
    assert record.at_us - START_US == span_us


@pytest.mark.parametrize(
    ("line", "frame"),
    [
        ("0.311250987 1  C0           Rx   d   8 38 FF 00 00 01 01 00 00 ", "0C0#38FF000001010000"),
        ("0.1 1  705  Rx   d 1 7F  Length = 244016 BitCount = 125 ID = 384", "705#7F"),
        ("0.1 1  18EBFF00x       Rx d 2 01 A0", "18EBFF00#01A0"),
        ("0.1 1  18EBFF00        Rx d 2 01 A0", "18EBFF00#01A0"),
        ("0.1 1  3FF  Tx   d D 55 AA 01 02 03 04 05 06", "3FF#55AA010203040506"),
        ("0.1 1  100 Tx r", "100#R"),
        ("0.1 1  100 Tx r 8 Length = 1704000 BitCount = 145 ID = 88888888x", "100#R8"),
        ("0.1 1  100 Tx r Length = 1704000", "100#R"),
        ("0.1 1 ErrorFrame ECC: 10100010", "20000080#0000000000000000"),
        ("0.1 CANFD 1 Rx ErrorFrame Not Acknowledge error, fffe c7", "20000080#0000000000000000"),
        ("0.1 CANFD 1 Tx ErrorFrame", "20000080#0000000000000000"),
        (
            "0.1 CANFD 3 Rx 30a Name_12 1 1 8 8 01 02 03 04 05 06 07 08 1 1 303000",
            "30A##30102030405060708",
        ),
        ("0.1 CANFD 3 Tx 50005x 0 1 5 0 140000 73 200050 7a60", "00050005#R5"),
        ("0.1 CANXL 2 Rx CBFF 243215 176 432 name 8 2 e1 89 f1 40 0 0 0", "432#E189"),
        ("0.1 CANXL 2 Rx CEFF 243215 176 432x 8 2 e1 89 f1 40 0 0 0", "00000432#E189"),
        ("0.1 CANXL 2 Rx FBFF 243215 176 432 2 2 e1 89 a 12345 7000 0 0", "432##3E189"),
    ],
)
def test_a_line_says_this_frame(line: str, frame: str, tmp_path: Path) -> None:
    reader = read_log(log(tmp_path, f"{DATE}{HEX}   {line}\n"))
    assert [str(record.frame) for record in reader] == [frame]
    assert reader.tally.messages("x") == []


def test_a_frame_of_64_bytes_is_one_of_can_fd_whatever_its_flags(tmp_path: Path) -> None:
    data = "00 " * 64
    (record,) = read(
        tmp_path, f"{HEX}  30.5 CANFD   4 Rx   4EE   0 1 f 64 {data}1331984 11 0 4650\n"
    )
    assert str(record.frame) == "4EE##2" + "00" * 64


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ("0.1 1 705 TxRq d 1 7F", "lines with other events"),
        ("0.1 1 OverloadFrame", "lines with other events"),
        ("0.1 1 J1939TP FEE3p 6 0 0 - Rx d 3 A0 0F A6", "lines with other events"),
        ("0.1 L1 34 Rx 2 01 02 checksum = 1", "lines with other events"),
        ("0.1 CANXL 2 Rx XLFF 984438 4656 432 e0 0 1 2 1 1f96 00 00000000 e1 89", "CAN XL frames"),
    ],
)
def test_what_is_no_frame_of_can_is_counted(line: str, what: str, tmp_path: Path) -> None:
    reader = read_log(log(tmp_path, f"{HEX}   {line}\n"))
    assert list(reader) == []
    assert (reader.tally.passed_over, reader.tally.bad_lines.count) == ({what: 1}, 0)


@pytest.mark.parametrize(
    "line",
    [
        "0.1 1 705 Rx d",
        "0.1 1 705 Rx d 2 7F",
        "0.1 1 705 Rx d 1 1FF",
        "0.1 1 XYZ Rx d 1 7F",
        "0.1 CANFD 1 Rx 123 1 0 9",
        "0.1 CANFD 1 Rx 123 1 0 2 2 AA",
        "0.1 CANFD 1 Rx 123",
        "0.1 CANXL 1 Rx CBFF 1 2 123 8 2",
        "0.1 CANXL 1 Rx CBFF",
        "0,1 1 705 Rx d 1 7F",
    ],
)
def test_a_line_that_was_meant_as_a_frame_is_bad(line: str, tmp_path: Path) -> None:
    reader = read_log(log(tmp_path, f"{DATE}{HEX}{line}\n{BEATS}"))
    assert len(list(reader)) == 3
    assert reader.tally.bad_lines.count == 1


def test_numbers_are_decimal_where_the_base_is(tmp_path: Path) -> None:
    text = "base dec  timestamps absolute\n 0.1 1 1797 Rx d 2 127 10\n"
    text += " 0.2 CANFD 1 Rx 1797 0 0 2 2 255 16 0 0 1000 0\n"
    assert [str(one.frame) for one in read(tmp_path, text)] == ["705#7F0A", "705##0FF10"]


def test_bytes_of_three_digits_are_decimal_where_no_base_is_named(tmp_path: Path) -> None:
    text = DATE + "50165.474900 1 0940 Tx d 8 153 000 000 102 000 000 153 000 \n"
    assert [str(one.frame) for one in read(tmp_path, text)] == ["3AC#9900006600009900"]


def test_what_a_log_tells_of_errors_beside_error_frames_is_kept(tmp_path: Path) -> None:
    reader = read_log(
        log(
            tmp_path,
            HEX
            + " 0.1 CAN 1 Status:chip status error passive - TxErr: 132 RxErr: 0\n"
            + " 0.1 CAN 2 Status:chip status error active\n"
            + " 1.0 1  Statistic: D 0 R 0 XD 0 XR 0 E 0 O 0 B 0.00%\n"
            + " 2.0 1  Statistic: D 9 R 0 XD 0 XR 0 E 3 O 0 B 0.00%\n"
            + BEATS,
        )
    )
    assert len(list(reader)) == 3
    assert reader.tally.errors("run.asc") == [
        "run.asc: it says that a controller is error passive: 1 time",
        "run.asc: it says that error frames were counted: 1 time",
    ]


def test_python_can_reads_the_same_where_the_header_is_vectors(tmp_path: Path) -> None:
    path = log(tmp_path, DATE + HEX + "internal events logged\n" + BEATS)
    with can.ASCReader(path, relative_timestamp=False) as foreign:
        theirs = [(round(one.timestamp * 1e6), bytes(one.data)) for one in foreign]
    assert theirs == [(one.at_us, one.frame.data) for one in read_log(path)]
