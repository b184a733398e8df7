"""Kinds of logs that people reported of other tools, each read as its writer meant it.

The logs are written for this test. Each stands for what is special in a reported one: its header,
its columns, its line ends, or what stands between the frames.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import can
import pytest

from tests.host.canmon.model.columns.test_column_reader import rows_by_line, rows_of
from tickrig.host.canmon.model.columns.column_reader import read_columns
from tickrig.host.canmon.model.columns.columns import NoColumnsError
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.model.logs.log_writer import log_line


class Report(NamedTuple):
    """A kind of log.

    Attributes:
        name: of the file.
        text: what is in it.
        frames: what is read, as lines of candump, with the seconds as short as can be.
        bad: lines that are no frames.
        lost: frames that it says were lost.
    """

    name: str
    text: str
    frames: list[str]
    bad: int = 0
    lost: int = 0


BYTES = "11 22 33 44 55 66 77 88"
DIGITS = BYTES.replace(" ", "")

SCREENS = {
    "plain lines with CRLF and blanks at their ends": Report(
        "screen.txt",
        f"  can0  705   [1]  7F\r\n  can0  123   [8]  {BYTES}   \r\n",
        ["0 can0 705#7F", f"0 can0 123#{DIGITS}"],
    ),
    "an ASCII column with quotes and blanks in it": Report(
        "screen.txt",
        " (000.000000)  vcan0  123   [4]  27 20 27 20               '' ' '\n",
        ["0 vcan0 123#27202720"],
    ),
    "bytes from the last to the first": Report(
        "screen.txt",
        " (000.000000)  can0  123   [8]  88`77`66`55`44`33`22`11\n"
        " (000.500000)  can0  124   [1]  7F                        '.'\n"
        " (000.750000)  can0  125   [2]  41`42                     `AB`\n",
        [f"0 can0 123#{DIGITS}", "0.5 can0 124#7F", "0.75 can0 125#4241"],
    ),
    "bytes as bits": Report(
        "screen.txt",
        " (000.000000)  can0  123   [2]  00010001 11111110\n"
        " (000.500000)  can0  123   [2]  11111110`00010001\n",
        ["0 can0 123#11FE", "0.5 can0 123#11FE"],
    ),
    "raw length codes": Report(
        "screen.txt",
        f" (000.000000)  can0  123   {{C}}  {BYTES}\n"
        " (000.500000)  can0  123   {2}  11 22\n"
        " (000.750000)  can0  123   {F}  remote request\n",
        [f"0 can0 123#{DIGITS}", "0.5 can0 123#1122", "0.75 can0 123#R8"],
    ),
    "a date in front, CAN FD and flags": Report(
        "screen.txt",
        " (1970-01-02 00:00:00.000125)  can0  RX B -  123  [12]  00 01 02 03 04 05 06 07 08 09 0A"
        " 0B\n (1970-01-02 00:00:00.000250)  can0  TX - -  124  [01]  AA\n",
        ["86400.000125 can0 123##1000102030405060708090A0B", "86400.00025 can0 124##0AA T"],
    ),
    "error frames with their words below": Report(
        "screen.txt",
        " (000.000000)  can0  20000088   [8]  00 00 80 19 00 00 00 00   ERRORFRAME\n"
        "\tprotocol-violation{{tx-error}{acknowledge-slot}}\n\tbus-error\n"
        " (001.000000)  can0  705   [1]  7F\n",
        ["0 can0 20000088#0000801900000000", "1 can0 705#7F"],
    ),
    "spans from frame to frame": Report(
        "screen.txt",
        "".join(
            f" ({span})  can0  705   [1]  7F\n"
            for span in ("000.000000", "001.000000", "000.250000", "001.000000", "000.500000")
        ),
        [f"{at} can0 705#7F" for at in ("0", "1", "1.25", "2.25", "2.75")],
    ),
    "a prompt around it": Report(
        "screen.txt",
        "user@host:~$ candump -t z can0\n (000.000000)  can0  705   [1]  7F\n^C\n",
        ["0 can0 705#7F"],
        bad=2,
    ),
    "frames that its socket dropped": Report(
        "screen.txt",
        " (000.000000)  can0  705   [1]  7F\n"
        "DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 3)\n"
        " (001.000000)  can0  705   [1]  7F\n"
        "DROPCOUNT: dropped 1 CAN frame on 'can0' socket (total drops 4)\n",
        ["0 can0 705#7F", "1 can0 705#7F"],
        lost=4,
    ),
    "lines that python-can printed": Report(
        "logger.txt",
        "Timestamp:        1.500000    ID:      123    S Rx                DL:  2"
        "    61 62                       'ab'    Channel: can1\n"
        "Timestamp:        1.750000    ID: 00000123    X Tx   R            DL:  4"
        "                                Channel: can1\n"
        "Timestamp:        2.000000    ID:      7ff    S Rx                DL:  0\n"
        "Timestamp:        2.500000    ID:      004    S Rx E              DL:  8"
        "    00 08 00 00 00 00 60 00     Channel: 0\n"
        "Timestamp:        3.000000    ID:      123    S Rx     F BS EI    DL:  1    7f\n"
        "Timestamp:        4.000000    ID:      123    S Rx                DL:  2    7f\n",
        [
            "1.5 can1 123#6162",
            "1.75 can1 00000123#R4 T",
            "2 can0 7FF#",
            "2.5 0 20000004#0008000000006000",
            "3 can0 123##37F",
        ],
        bad=1,
    ),
}

CANDUMP_LOGS = {
    "a direction behind each frame": Report(
        "run.log",
        "(0000000001.000000) can0 705#7F R\n(0000000001.500000) can0 605#40 T\n",
        ["1 can0 705#7F", "1.5 can0 605#40 T"],
    ),
    "times from 0, small letters and dots": Report(
        "run.log",
        "(0000000000.000000) can0 0f6#7adfe07bd2\n(0000000000.500000) can0 044#11.22.33\n",
        ["0 can0 0F6#7ADFE07BD2", "0.5 can0 044#112233"],
    ),
    "raw length codes of data and remote frames": Report(
        "run.log",
        f"(0000000001.000000) can0 123#{DIGITS}_C\n(0000000002.000000) can0 123#R8_F\n",
        [f"1 can0 123#{DIGITS}", "2 can0 123#R8"],
    ),
    "nanoseconds, and names with dots": Report(
        "run.log",
        "(0000000001.000125999) slcan.0 705#7F\n(1.5) can0.2 705#7F\n",
        ["1.000125 slcan.0 705#7F", "1.5 can0.2 705#7F"],
    ),
    "frames that its socket dropped": Report(
        "run.log",
        "(0000000001.000000) can0 705#7F\n"
        "DROPCOUNT: dropped 12 CAN frames on 'can0' socket (total drops 12)\n"
        "(0000000002.000000) can0 705#7F\n",
        ["1 can0 705#7F", "2 can0 705#7F"],
        lost=12,
    ),
    "a last line that was cut": Report(
        "run.log",
        "(0000000001.000000) can0 705#7F\n(0000000002.000000) can0 70",
        ["1 can0 705#7F"],
        bad=1,
    ),
}

HEAD = "date Thu Jan 1 12:00:00 AM 1970\nbase hex  timestamps absolute\n"

ASC_LOGS = {
    "a symbolic name behind the CAN-ID of CAN FD": Report(
        "run.asc",
        HEAD + "internal events logged\n// version 8.1.0\n"
        "   0.100000 CANFD   2 Rx        123  Engine_Status    1 0 8  8 " + BYTES + "  0 0 1000 0\n"
        "   0.200000 CANFD   2 Tx  18FF0001x                   0 0 1  1 7F  0 0 0 0 0 0 0 0\n",
        [f"0.1 can1 123##1{DIGITS}", "0.2 can1 18FF0001#7F T"],
    ),
    "a trigger block without a date, nine digits of time": Report(
        "run.asc",
        HEAD + "// File created by a logger\nBegin Triggerblock\n"
        " 0.000125000 1  705             Rx   d 1 7F\n End TriggerBlock\n",
        ["0.000125 can0 705#7F"],
    ),
    "a header twice, and its frames behind the second": Report(
        "run.asc",
        HEAD + HEAD + "no internal events logged\n"
        "   1.000000 1  705             Rx   d 1 7F\n   2.000000 1  605      Tx   d 1 40\n",
        ["1 can0 705#7F", "2 can0 605#40 T"],
    ),
    "a length code above 8": Report(
        "run.asc",
        HEAD + f"   1.000000 1  123             Rx   d F {BYTES}\n",
        [f"1 can0 123#{DIGITS}"],
    ),
    "a line of garbage, and transport messages of J1939": Report(
        "run.asc",
        HEAD + "   0.5 1  J1939TP FEE3p 6 0 0 - Rx d 10 A0 0F A6 60 3B D1 40 1F DE 80\n"
        "   1.000000 1  123             Rx   d 9 1\n log_event 12\n"
        "   2.000000 1  123x            Rx   d 2 01 02\n",
        ["2 can0 00000123#0102"],
        bad=2,
    ),
    "remote frames with a length or without": Report(
        "run.asc",
        HEAD + "   1.0 1  123             Rx   r\n   2.0 1  123  Tx   r 4\n"
        "   3.0 1  123  Rx   r  Length = 0 BitCount = 50 ID = 291\n",
        ["1 can0 123#R", "2 can0 123#R4 T", "3 can0 123#R"],
    ),
    "comments, environment variables and texts among frames": Report(
        "run.asc",
        HEAD + "   0.1 // a note 1 123 Rx d 1 7F\n   0.2 EnvVar := 1\n"
        '   0.3 SV: 2 0 1 ::Speed = 12\n   0.4 "typed 1 123 Rx"\n'
        "   1.0 1  705  Rx   d 1 7F\n",
        ["1 can0 705#7F"],
    ),
}

TRC_LOGS = {
    "version 1.0, a remote frame and a row that was cut": Report(
        "run.trc",
        ";   Message Number\n;   |    Time Offset (ms)\n;---+--   ----+----\n"
        "     1)      1000  00000123  8  11 22 33 44 55 66 77 88\n"
        "     2)      1500      0123  3  RTR\n     3)      17\n"
        "     4)      2000      0705  1  7F\n",
        [f"1 can0 00000123#{DIGITS}", "1.5 can0 123#R3", "2 can0 705#7F"],
        bad=1,
    ),
    "version 1.1 with an error line and tenths": Report(
        "run.trc",
        ";$FILEVERSION=1.1\n;$STARTTIME=25569.0\n"
        "     1)      1000.5  Rx         0123  1  7F\n"
        "     2)      1500.0  Error      0008  4  00 19 08 08\n",
        ["1.0005 can0 123#7F", "1.5 can0 200002A8#0000801900000808"],
    ),
    "version 2.1 of a viewer, semicolons behind the values": Report(
        "run.trc",
        ";$FILEVERSION=2.1;\n;$STARTTIME=25569.0000000000;\n;$COLUMNS=N,O,T,B,I,d,R,L,D;\n"
        "      1      1000.000 DT 2      0123 Tx -  2    11 22\n"
        "      2      2000.000 FB 1  00000123 Rx -  1    7F\n"
        "      3      2500.000 RR 1      0123 Rx -  2\n",
        ["1 can1 123#1122 T", "2 can0 00000123##17F", "2.5 can0 123#R2"],
    ),
}

GVRET_LOGS = {
    "a comma behind each row, and times below 0": Report(
        "run.csv",
        "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n"
        "-2000000,00000123,false,Rx,0,2,11,22,00,00,00,00,00,00,\n"
        "-500000,18FF0001,true,Tx,1,1,7F,00,00,00,00,00,00,00,\n",
        ["0 can0 123#1122", "1.5 can1 18FF0001#7F T"],
    ),
    "a CAN-ID that is extended and not said to be": Report(
        "run.csv",
        "Time Stamp,ID,Extended,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n"
        "1000000,18FF0001,false,0,1,7F,00,00,00,00,00,00,00\n",
        ["1 can0 18FF0001#7F"],
    ),
}

REPORTS = {
    f"{kind}: {what}": report
    for kind, reports in (
        ("candump screen", SCREENS),
        ("candump log", CANDUMP_LOGS),
        ("asc", ASC_LOGS),
        ("trc", TRC_LOGS),
        ("gvret", GVRET_LOGS),
    )
    for what, report in reports.items()
}


@pytest.fixture(autouse=True)
def greenwich(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Logs have dates of the local time."""
    with monkeypatch.context() as patched:
        patched.setenv("TZ", "UTC")
        time.tzset()
        yield
    time.tzset()


def placed(report: Report, folder: Path) -> Path:
    path = folder / report.name
    path.write_bytes(report.text.encode("utf-8"))
    return path


def shown(line: str) -> str:
    stamp, rest = line.split(") ")
    return f"{float(stamp[1:]):.12g} {rest}"


@pytest.mark.parametrize("report", REPORTS.values(), ids=REPORTS)
def test_a_reported_kind_of_log_is_read_as_meant(report: Report, tmp_path: Path) -> None:
    reader = read_log(placed(report, tmp_path))
    assert [shown(log_line(record)) for record in reader] == report.frames
    assert (reader.tally.bad_lines.count, reader.tally.lost) == (report.bad, report.lost)


@pytest.mark.parametrize("report", REPORTS.values(), ids=REPORTS)
def test_a_reported_kind_of_log_is_read_in_blocks_as_line_by_line(
    report: Report, tmp_path: Path
) -> None:
    path = placed(report, tmp_path)
    reader = read_columns(path)
    if any("##" in line for line in report.frames):
        with pytest.raises(NoColumnsError):
            rows_of(reader)
    else:
        assert (rows_of(reader), reader.tally) == rows_by_line(path)


def test_what_python_can_prints_is_read_as_it_was_heard(tmp_path: Path) -> None:
    frames = [
        can.Message(1.5, 0x123, is_extended_id=False, data=b"ab", channel="can0"),
        can.Message(2.5, 0x123, data=b"\x01\x02", is_rx=False),
        can.Message(3.5, 0x123, is_extended_id=False, is_remote_frame=True, dlc=4, channel=0),
        can.Message(4.5, 0x1FFFFFFF, is_fd=True, bitrate_switch=True, data=bytes(12)),
        can.Message(5.5, 4, is_extended_id=False, is_error_frame=True, data=bytes(8)),
    ]
    with can.Logger(tmp_path / "run.txt") as logger:
        for frame in frames:
            logger(frame)
    read = [shown(log_line(record)) for record in read_log(tmp_path / "run.txt")]
    assert read == [
        "1.5 can0 123#6162",
        "2.5 can0 00000123#0102 T",
        "3.5 0 123#R4",
        "4.5 can0 1FFFFFFF##1000000000000000000000000",
        "5.5 can0 20000004#0000000000000000",
    ]


@pytest.mark.parametrize(
    ("head", "whose"),
    [
        ("***BUSMASTER Ver 3.2.2***", "a log of BUSMASTER"),
        ("Microchip Technology Inc.", "a log of Microchip's CAN BUS Analyzer"),
        ("0.0 CXX GVRET-PC Reverse Engineering Tool Output", "a CRTD log"),
        ("ID,Data Bytes", "a list of frames without times"),
        ("@ TEXT @ 6 @ 0 @", "a trace of CARBUS Analyzer"),
    ],
)
def test_a_log_of_another_program_is_named_in_one_line(
    head: str, whose: str, tmp_path: Path
) -> None:
    path = tmp_path / "run.log"
    path.write_text(head + "\nsome line\n" * 9)
    reader = read_log(path)
    assert list(reader) == []
    (said,) = reader.tally.messages("run.log")
    assert said.startswith(f"run.log: {whose} is not read (10 lines); SavvyCAN saves it as GVRET")
