from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.log_file import LogTally
from tickrig.host.canmon.model.logs.log_reader import LONGEST, LogLines, WholeLines, parse_log_line
from tickrig.host.canmon.model.logs.log_writer import log_line
from tickrig.host.canmon.model.logs.notation import json_line
from tickrig.wire.can import FD_LENGTHS, CanFrame, ErrorFrame, FdFrame

NO, YES = st.just(False), st.just(True)
DATA = st.binary(max_size=8)
FD_DATA = st.sampled_from(FD_LENGTHS).flatmap(
    lambda length: st.binary(min_size=length, max_size=length)
)
FRAMES = st.one_of(
    st.builds(CanFrame, st.integers(0, 0x7FF), DATA, NO, NO, st.just(0)),
    st.builds(CanFrame, st.integers(0, 0x1FFF_FFFF), DATA, NO, YES, st.just(0)),
    st.builds(CanFrame, st.integers(0, 0x7FF), st.just(b""), YES, NO, st.integers(0, 8)),
    st.builds(ErrorFrame, st.integers(0, 0x1FFF_FFFF), st.binary(min_size=8, max_size=8)),
    st.builds(FdFrame, st.integers(0, 0x7FF), FD_DATA, NO, st.integers(0, 3)),
    st.builds(FdFrame, st.integers(0, 0x1FFF_FFFF), FD_DATA, YES, st.integers(0, 3)),
)
HEARDS = st.builds(
    Record,
    st.integers(0, 4_000_000_000_000_000),
    st.from_regex(r"[!-~]{1,16}", fullmatch=True),
    FRAMES,
    st.booleans(),
)


def read(line: str) -> tuple[Record | None, LogTally]:
    tally = LogTally()
    return parse_log_line(line, 1, tally), tally


@given(st.lists(HEARDS), st.booleans())
def test_what_is_written_is_read_again(records: list[Record], as_json: bool) -> None:
    write = json_line if as_json else log_line
    lines = LogLines()
    text = "".join(f"{write(record)}\n" for record in records)
    assert lines.push(text.encode()) == records
    assert lines.tally == LogTally()


@given(st.lists(st.binary(max_size=40)))
def test_noise_in_pieces_is_counted_as_in_one(pieces: list[bytes]) -> None:
    one, many = LogLines(), LogLines()
    whole = one.push(b"".join(pieces)) + one.finish()
    assert [record for piece in pieces for record in many.push(piece)] + many.finish() == whole
    assert many.tally == one.tally


@pytest.mark.parametrize(
    ("line", "at_us", "frame"),
    [
        ("(1436509052.249713999) can0 705#7F", 1_436_509_052_249_713, "705#7F"),
        ("(0.0) can0 705#7F", 0, "705#7F"),
        ("(000.000012)  vcan0  00000605#40 R", 12, "00000605#40"),
        ("(0.5) can0 123#11.22.33", 500_000, "123#112233"),
        ("(0.5) can0 123#0011223344556677_C", 500_000, "123#0011223344556677"),
        ("(0.5) can0 123#R8_9", 500_000, "123#R8"),
        ("(0.5) can0 20000080#", 500_000, "20000080#0000000000000000"),
        ("(0.5) can0 20000080#01", 500_000, "20000080#0100000000000000"),
        ("(0.5) \xa0can0 123#11", 500_000, "123#11"),
        ('{"t":0.5,"ch":"\xa0can0","id":291,"x":0,"data":"11"}', 500_000, "123#11"),
        ("(0.5) can0 123##511.22 R", 500_000, "123##11122"),
        ("(0.5) can0 00000123##2" + "11" * 9, 500_000, "00000123##2" + "11" * 9 + "000000"),
    ],
)
def test_lines_of_other_programs_are_read(line: str, at_us: int, frame: str) -> None:
    record, tally = read(line)
    assert record is not None
    assert (record.at_us, str(record.frame), tally) == (at_us, frame, LogTally())


@pytest.mark.parametrize("line", ["", "  ", "# made by hand", "; note", "// note", "\r"])
def test_empty_lines_and_comments_are_no_fault(line: str) -> None:
    assert read(line) == (None, LogTally())


def test_frames_of_can_xl_are_passed_over_and_counted() -> None:
    record, tally = read("(0.5) can0 45123#81:00:12345678#11223344")
    assert (record, tally.passed_over, tally.bad_lines.count) == (None, {"CAN XL frames": 1}, 0)


@pytest.mark.parametrize(
    "line",
    [
        "(0.5) can0 800#",
        "(0.5) can0 40000000#",
        "(0.5) can0 123#001122334455667788",
        "(0.5) can0 123#0",
        "(0.5) can0 123##",
        "(0.5) can0 800##1",
        "(0.5) can0 123##1" + "00" * 65,
        "(0.5) can0 123",
        "(.5) can0 123#",
        "can0 123#",
        "{}",
        "[1]",
        '{"v":1,"t":1e400,"ch":"can0","id":1,"x":0,"data":""}',
        '{"v":1,"t":-1.5,"ch":"can0","id":1,"x":0,"data":""}',
        '{"v":1,"t":1e12,"ch":"can0","id":1,"x":0,"data":""}',
        '{"v":1,"t":1.5,"ch":"' + "a" * 33 + '","id":1,"x":0,"data":""}',
        '{"v":1,"t":NaN,"ch":"can0","id":1,"x":0,"data":""}',
        '{"v":1,"t":1,"ch":"can 0","id":1,"x":0,"data":""}',
        '{"v":1,"t":1,"ch":"can0","id":2048,"x":0,"data":""}',
        '{"v":1,"t":1,"ch":"can0","id":1,"x":0,"data":"0"}',
        "{" * 10_000,
    ],
)
def test_other_lines_are_bad(line: str) -> None:
    assert read(line)[1].bad_lines.first == [(1, line)]


def test_the_first_bad_lines_are_kept_and_all_are_counted() -> None:
    lines = LogLines()
    lines.push(b"x\n" * 7)
    assert lines.tally.messages("run.log")[0] == "run.log: line 1 is no frame: 'x'"
    assert lines.tally.messages("run.log")[-1] == (
        "run.log: 7 lines are no frames; the first 5 are shown"
    )


def test_an_unknown_event_in_json_is_no_fault() -> None:
    assert read('{"v":1,"ev":"hello"}') == (None, LogTally())


def test_a_text_without_a_line_end_is_held_only_up_to_a_limit() -> None:
    whole = WholeLines()
    assert not any(whole.push(bytes(1 << 16)) for _ in range(100))
    assert len(whole.push(b"\nnext")) == LONGEST + 1
    assert whole.finish() == b"next"
