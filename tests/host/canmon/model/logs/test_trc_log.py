"""PEAK's traces of each version, with what stands between the frames."""

from __future__ import annotations

from pathlib import Path

import can
import pytest

from tickrig.host.canmon.model.logs.log_file import LogError
from tickrig.host.canmon.model.logs.log_reader import read_log

BODIES = {
    "1.0": (
        "     1)      1841      0601  8  00 01 02 03 04 05 06 07\n"
        "     2)      1842      0008  4  ERROR 00 19 08 08\n"
        "     3)      1843  FFFFFFFF  4  00 00 00 04 -- -- -- --  BUSLIGHT\n"
        "     4)      1844  00000705  3  RTR\n"
    ),
    "1.1": (
        "     1)      1841.0  Rx         0601  8  00 01 02 03 04 05 06 07\n"
        "     2)      1842.0  Error      0008  4  00 19 08 08\n"
        "     3)      1843.0  Warng  FFFFFFFF  4  00 00 00 04  BUSLIGHT\n"
        "     4)      1844.0  Tx     00000705  3  RTR\n"
    ),
    "1.2": (
        "     1)      1841.000  1  Rx         0601  8  00 01 02 03 04 05 06 07\n"
        "     2)      1842.000  1  Error      0008  4  00 19 08 08\n"
        "     3)      1843.000  1  Warng  FFFFFFFF  4  00 00 00 04  BUSLIGHT\n"
        "     4)      1844.000  2  Tx     00000705  3  RTR\n"
    ),
    "1.3": (
        "     1)      1841.000 1  Rx        0601 -  8    00 01 02 03 04 05 06 07\n"
        "     2)      1842.000 1  Error     0008 -  4    00 19 08 08\n"
        "     3)      1843.000 1  Warng FFFFFFFF -  4    00 00 00 04 BUSLIGHT\n"
        "     4)      1844.000 2  Tx    00000705 -  3    RTR\n"
    ),
    "2.0": (
        "      1      1841.000 DT     0601 Rx 8  00 01 02 03 04 05 06 07\n"
        "      2      1842.000 ER          Rx    08 00 19 08 08\n"
        "      3      1843.000 ST          Rx    00 00 00 04\n"
        "      4      1844.000 RR 00000705 Tx 3\n"
    ),
    "2.1": (
        "      1      1841.000 DT 1      0601 Rx -  8    00 01 02 03 04 05 06 07\n"
        "      2      1842.000 ER 1         - Rx -  5    08 00 19 08 08\n"
        "      3      1843.000 ST 1         - Rx -  4    00 00 00 04\n"
        "      4      1844.000 RR 2  00000705 Tx -  3\n"
    ),
    "3.0": (
        "      1      1841.000 DT 1       601 Rx - - - - - - 8    00 01 02 03 04 05 06 07\n"
        "      2      1842.000 ER 1         - Rx - - - - - - 5    08 00 19 08 08\n"
        "      3      1843.000 ST 1         - Rx - - - - - - 4    00 00 00 04\n"
        "      4      1844.000 RR 2  00000705 Tx - - - - - - 3\n"
    ),
}
COLUMNS = {"2.0": "N,O,T,I,d,l,D", "2.1": "N,O,T,B,I,d,R,L,D", "3.0": "N,O,T,B,I,d,R,V,S,A,r,s,L,D"}


def trace(folder: Path, version: str, body: str | None = None, start: str = "25569.5") -> Path:
    head = "" if version == "1.0" else f";$FILEVERSION={version}\n;$STARTTIME={start}\n"
    columns = f";$COLUMNS={COLUMNS[version]}\n" if version in COLUMNS else ""
    path = folder / "run.trc"
    text = f"{head}{columns};   a comment\n{BODIES[version] if body is None else body}"
    path.write_text(text.replace("\n", "\r\n"), "ascii")
    return path


@pytest.mark.parametrize("version", BODIES)
def test_a_trace_of_each_version_is_read_with_its_error_frames(
    version: str, tmp_path: Path
) -> None:
    reader = read_log(trace(tmp_path, version))
    records = list(reader)
    assert [str(one.frame) for one in records] == [
        "601#0001020304050607",
        "200002A8#0000801900000808",
        "00000705#R3",
    ]
    start_us = 0 if version == "1.0" else 43_200_000_000
    assert [one.at_us - start_us for one in records] == [1_841_000, 1_842_000, 1_844_000]
    assert [one.sent for one in records] == [False, False, version != "1.0"]
    has_buses = version in ("1.2", "1.3", "2.1", "3.0")
    assert [one.channel for one in records] == ["can0", "can0", "can1" if has_buses else "can0"]
    assert reader.tally.bad_lines.count == 0
    assert reader.tally.errors("x") == [
        "x: it says that a controller has reached its warning limit (BUSLIGHT): 1 time"
    ]


@pytest.mark.parametrize("version", ["1.0", "1.1", "1.3", "2.0", "2.1"])
def test_python_can_reads_the_same_frames_but_the_error_frames(
    version: str, tmp_path: Path
) -> None:
    path = trace(tmp_path, version, BODIES[version].replace("0008  4  ERROR", "FFFFFFFF  4 "))
    with can.TRCReader(path) as foreign:
        theirs = [(one.arbitration_id, one.is_extended_id, bytes(one.data)) for one in foreign]
    ours = [one.frame for one in read_log(path) if not str(one.frame).startswith("2000")]
    assert [(one.can_id, one.extended, one.data) for one in ours] == theirs  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("line", "frame"),
    [
        ("ER 1 - Rx - 5 04 00 02 00 00", "20000088#0000840200000000"),
        ("ER 1 - Rx - 5 02 01 05 80 00", "20000288#0000020500000080"),
        ("ER 1 - Rx - 5 01 00 0A 00 10", "20000288#0000810A00001000"),
        ("ER 1 - Rx - 0", "20000088#0000000000000000"),
        ("FD 1 0500 Tx - 9 01 02 03 04 05 06 07 08 09 0A 0B 0C", "500##00102030405060708090A0B0C"),
        ("FE 1 0500 Tx - 0", "500##3"),
        ("DT 1 0500 Tx - 9 01 02 03 04 05 06 07 08", "500#0102030405060708"),
    ],
)
def test_a_line_says_this_frame(line: str, frame: str, tmp_path: Path) -> None:
    reader = read_log(trace(tmp_path, "2.1", f"      1      1841.000 {line}\n"))
    assert [str(one.frame) for one in reader] == [frame]
    assert reader.tally.messages("x") == []


@pytest.mark.parametrize(
    ("line", "what", "told"),
    [
        ("EV 1  User-defined event for bus 1", "lines with other events", ""),
        ("EV -  Rx 0000", "lines with other events", ""),
        ("EC 1  - Rx - 2 00 00", "lines with other events", ""),
        ("EC 1  - Rx - 2 02 02", "lines with other events", "that error counters are above 0"),
        ("ST 1  - Rx - 4 00 00 00 00", "lines with other events", ""),
        ("ST 1  - Rx - 4 00 00 00 18", "lines with other events", "that a controller is bus-off"),
        (
            "ST 1  - Rx - 4 00 04 00 08",
            "lines with other events",
            "that a controller is error passive",
        ),
        ("XL 1  100 Tx - 4 03 11 22 33", "CAN XL frames", ""),
    ],
)
def test_what_is_no_frame_is_counted(line: str, what: str, told: str, tmp_path: Path) -> None:
    reader = read_log(trace(tmp_path, "2.1", f"      1      1841.000 {line}\n"))
    assert list(reader) == []
    assert (reader.tally.passed_over, reader.tally.bad_lines.count) == ({what: 1}, 0)
    assert list(reader.tally.errors_told) == ([told] if told else [])


@pytest.mark.parametrize(
    "line",
    [
        "DT 1 0601 Rx - 8 00 01",
        "DT 1 0601 Rx - 1 00 01",
        "DT 1 0601 Rx - x 00",
        "DT 1 06G1 Rx - 1 00",
        "DT z 0601 Rx - 1 00",
        "ZZ 1 0601 Rx - 1 00",
        "FD 1 0601 Rx - 16 00",
        "DT",
        "",
    ],
)
def test_a_line_that_was_meant_as_a_frame_is_bad(line: str, tmp_path: Path) -> None:
    body = f"      1      1841.000 {line}\n{BODIES['2.1']}"
    reader = read_log(trace(tmp_path, "2.1", body))
    assert len(list(reader)) == 3
    assert reader.tally.bad_lines.count == 1


def test_a_trace_without_a_date_begins_at_0(tmp_path: Path) -> None:
    for start in ("0.0", "never", "1e300", "nan"):
        reader = read_log(trace(tmp_path, "2.1", start=start))
        assert next(iter(reader)).at_us == 1_841_000
        assert reader.tally.messages("x")[-1] == "x: its date cannot be read: times begin at 0"


def test_a_start_may_end_with_a_semicolon(tmp_path: Path) -> None:
    assert next(iter(read_log(trace(tmp_path, "1.2", start="25569.5;")))).at_us == 43_201_841_000


def test_a_version_whose_columns_nobody_names_is_refused(tmp_path: Path) -> None:
    path = trace(tmp_path, "2.1")
    path.write_text(path.read_text("ascii").replace("$COLUMNS", "$PILLARS"), "ascii")
    with pytest.raises(LogError, match=r"run\.trc is no trc log: File has no column information"):
        list(read_log(path))
