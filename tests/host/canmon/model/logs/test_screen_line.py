from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.columns.test_column_reader import rows_by_line, rows_of
from tests.host.canmon.model.logs.test_log_lines import FRAMES
from tickrig.host.canmon.model.columns.column_reader import read_columns
from tickrig.host.canmon.model.frames import AnyFrame, DumpLines, Record, Stamp
from tickrig.host.canmon.model.logs.log_file import LogTally
from tickrig.host.canmon.model.logs.log_reader import LogLines, parse_log_line, read_log
from tickrig.host.canmon.verbs.info import read_head

CANDUMP = """\
 (0000000001.000250)  can0  RX - -  705   [1]  7F                        '.'
 (0000000001.000500)  can0  TX B E  605   [8]  40 00 10 00 00 00 00 00   '@.......'
 (0000000001.000750)  can1  RX - -       123   [2]  11 22
 (0000000001.000900)  can1  RX - -  00000123   [0]  remote request
 (0000000001.001000)  can0  RX - -  20000004   [8]  00 08 00 00 00 00 00 00   ERRORFRAME
\tcontroller-problem{tx-error-warning}
\terror-counter-tx-rx{{96}{0}}
 (0000000001.001100)  can0  RX - E  123  [12]  00 01 02 03 04 05 06 07 08 09 0A 0B
 (0000000001.001200)  can0  RX - -  7FF   [0]
"""
READ = [
    "(0000000001.000250) can0 705#7F",
    "(0000000001.000500) can0 605#4000100000000000 T",
    "(0000000001.000750) can1 123#1122",
    "(0000000001.000900) can1 00000123#R",
    "(0000000001.001000) can0 20000004#0008000000000000",
    "(0000000001.001100) can0 123##2000102030405060708090A0B",
    "(0000000001.001200) can0 7FF#",
]
GAPS = st.lists(st.tuples(st.integers(0, 5_000_000), FRAMES, st.booleans()), min_size=1, max_size=9)


def read(text: str) -> tuple[list[Record], LogTally]:
    lines = LogLines()
    return lines.push(text.encode()) + lines.finish(), lines.tally


def records(text: list[str]) -> list[Record]:
    found = [parse_log_line(line, 1, LogTally()) for line in text]
    return [record for record in found if record]


def test_what_candump_shows_is_read_as_its_log() -> None:
    frames, tally = read(CANDUMP)
    assert frames == records(READ)
    assert (tally.passed_over, tally.bad_lines.count) == ({}, 0)


def test_without_stamps_frames_have_no_time_and_that_is_said() -> None:
    text = "".join(f"{line[22:]}\n" for line in CANDUMP.splitlines() if line.startswith(" "))
    frames, tally = read(text)
    assert frames == [record._replace(at_us=0) for record in records(READ)]
    assert tally.messages("run.txt")[-1] == "run.txt: 7 frames have no time"


def test_colours_are_passed_over() -> None:
    frames, _ = read(" \x1b[31m(001.5)  can0\x1b[0m  705   [1]  \x1b[1m7F\x1b[0m\n")
    assert frames == records(["(1.5) can0 705#7F"])


@given(gaps=GAPS, stamp=st.sampled_from(list(Stamp)), text=st.sampled_from(["", "5 nmt FF 00"]))
def test_what_dump_shows_is_read_again(
    gaps: list[tuple[int, AnyFrame, bool]], stamp: Stamp, text: str
) -> None:
    at_us, frames = 1_700_000_000_000_000, []
    for gap_us, frame, sent in gaps:
        at_us += gap_us
        frames.append(Record(at_us, "can0", frame, sent))
    lines = DumpLines(stamp, extra=True)
    found, tally = read("".join(f"{lines.line(record, text)}\n" for record in frames))
    begin_us = frames[0].at_us if stamp in (Stamp.ZERO, Stamp.DELTA) else 0
    assert [one._replace(at_us=0) for one in found] == [one._replace(at_us=0) for one in frames]
    assert (tally.bad_lines.count, tally.untimed) == (0, len(frames) * (not stamp))
    if stamp and stamp is not Stamp.DELTA:
        assert [one.at_us for one in found] == [one.at_us - begin_us for one in frames]


@pytest.mark.parametrize("in_blocks", [False, True])
def test_stamps_from_frame_to_frame_are_added_up(in_blocks: bool, tmp_path: Path) -> None:
    path = tmp_path / "run.txt"
    gaps_us = [0, *([100_012, 99_988] * 2_000)]
    line = " ({:03d}.{:06d})  can0  705   [1]  7F\n"
    path.write_text("".join(line.format(*divmod(gap, 1_000_000)) for gap in gaps_us))
    times = [one.at_us for one in read_log(path)]
    if in_blocks:
        times = [at_us for block in read_columns(path) for at_us in block.at_us.tolist()]
    assert (times[:3], times[-1]) == ([0, 100_012, 200_000], 400_000_000)
    assert read_head(path).last_us is None  # the end alone does not tell


def test_times_that_go_back_a_little_are_no_gaps() -> None:
    text = "".join(f" (000.00{n}000)  can0  705   [1]  7F\n" for n in (1, 2, 3, 5, 4, 6))
    assert [one.at_us // 1_000 for one in read(text)[0]] == [1, 2, 3, 5, 4, 6]


def test_one_stamp_that_falls_by_much_counts_from_the_frame_before() -> None:
    spans = ("000.000000", "000.250447", "000.355153", "000.290342", "000.380701")
    text = "".join(f" ({span})  vcan0  705   [1]  05\n" for span in spans)
    assert [one.at_us for one in read(text)[0]][2:] == [605_600, 895_942, 1_276_643]


def test_lines_of_serial_ports_are_counted() -> None:
    frames, tally = read(" (001.000000)  ttyS0  <  SA:64   rrc\n  ttyS0  >  01 41\n")
    assert (frames, tally.passed_over) == ([], {"lines of a serial port": 2})


@pytest.mark.parametrize(
    "line",
    [
        "  can0  705   [2]  7F",
        "  can0  705   [1]  7G",
        "  can0  705   [9]  00 11 22 33 44 55 66 77 88",
        "  can0  800   [1]  7F",
        "  can0  7F   [1]  7F",
        " (2025-13-01 00:00:00.000000)  can0  705   [1]  7F",
        "\twhat is this",
        "  ERROR  what",
    ],
)
def test_other_lines_are_bad(line: str) -> None:
    frames, tally = read(f"{line}\n")
    assert (frames, tally.bad_lines.first) == ([], [(1, line)])


SHOWN = st.one_of(
    st.sampled_from([line for line in CANDUMP.splitlines() if "[12]" not in line]),
    st.builds(" ({:03d}.{:06d})  can0  705   [1]  7F".format, *[st.integers(0, 999)] * 2),
    st.sampled_from(["  can0  705   [1]  7F", "(1.5) can0 705#7F", "timestamp,", "\t", "[1]"]),
)


@given(lines=st.lists(SHOWN, max_size=12))
def test_columns_are_what_single_lines_give(lines: list[str]) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder, "run.txt")
        path.write_text("".join(f"{line}\n" for line in lines))
        columns = read_columns(path)
        found = rows_of(columns)
        rows, tally = rows_by_line(path)
    assert (found, columns.tally) == (rows, tally)
