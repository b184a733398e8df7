"""Rules of frames: where they end, and how a log shows them."""

from __future__ import annotations

import pickle
from enum import IntEnum
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.emulators.lamp import Lamp
from tickrig.device.twin import twin
from tickrig.emulators.record.frames import (
    FrameFormat,
    by_delimiter,
    by_gap,
    by_length,
    by_size,
    hex_text,
)
from tickrig.emulators.record.wire_log import WireLog
from tickrig.emulators.serial.emulator import Emulator, LineSettings
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.plugin.journal_text import last_lines
from tickrig.host.text.trace import Mark
from tickrig.wire.instant import NEVER

RULES = [
    by_size(3),
    by_delimiter(b"\r\n"),
    by_length(b"\x55", at=1, extra=3),
    by_length(b"\x55\xaa", at=2, extra=0, size=2, order="little"),
    by_length(b"", at=0, extra=1),
    by_gap("2ms"),
]


def pieces(rule: FrameFormat, *chunks: bytes, at_us: int = 0) -> list[bytes]:
    splitter = rule.splitter()
    return [piece for chunk in chunks for piece in splitter.push(at_us, chunk)]


@pytest.mark.parametrize(
    ("rule", "data", "wanted"),
    [
        (by_size(2), b"abcde", [b"ab", b"cd"]),
        (by_delimiter(b"\r\n"), b"a\r\n\r\nb", [b"a", b""]),
        (by_length(b"U", at=1, extra=3), b"xxU\x01a-U\x00-U", [b"xx", b"U\x01a-", b"U\x00-"]),
        (by_length(b"UV", at=2, extra=3), b"xUUV\x00xUV", [b"xU", b"UV\x00", b"x"]),
        (
            by_length(b"U", at=1, extra=0, size=2),
            b"U\x00\x04aU\xff\xffU\x00\x03U",
            [b"U\x00\x04a", b"U\xff\xff", b"U\x00\x03"],
        ),
        (by_length(b"", at=0, extra=1), b"\x02ab\x00\x01", [b"\x02ab", b"\x00"]),
        (by_length(b"", at=0, extra=-1), b"\x01\x04ab\x00", [b"\x01\x04ab"[:1], b"\x04ab"]),
    ],
)
def test_a_rule_says_where_frames_end(rule: FrameFormat, data: bytes, wanted: list[bytes]) -> None:
    assert pieces(rule, data)[: len(wanted)] == wanted


@given(st.sampled_from(RULES), st.lists(st.binary(max_size=12) | st.just(b"\x55"), max_size=8))
def test_no_byte_is_lost_and_chunks_make_no_difference(
    rule: FrameFormat, chunks: list[bytes]
) -> None:
    data, splitter = b"".join(chunks), rule.splitter()
    found = [piece for chunk in chunks for piece in splitter.push(0, chunk)]
    assert rule.delimiter.join([*found, splitter.begun]) == data
    assert found == pieces(rule, data) == pieces(rule, *(bytes([value]) for value in data))


def test_a_silence_ends_a_frame_that_has_begun() -> None:
    splitter = by_length(b"U", at=1, extra=2, gap="20ms").splitter()
    assert splitter.push(1_000, b"U\x09ab") == []
    assert splitter.due_us == 21_000
    assert splitter.push(20_999, b"") == []
    assert splitter.push(21_000, b"U\x00") == [b"U\x09ab", b"U\x00"]
    assert splitter.due_us == NEVER
    splitter.push(22_000, b"U")
    splitter.clear()
    assert (splitter.begun, splitter.due_us) == (b"", NEVER)


def test_noise_without_an_end_does_not_fill_the_memory() -> None:
    assert [len(each) for each in pieces(by_gap(1_000), bytes(10_000))] == [4_096, 4_096]
    assert [len(each) for each in pieces(by_delimiter(b"!"), bytes(5_000))] == [4_096]


def test_what_cannot_be_is_refused() -> None:
    for gap in ("0", 0, "-1ms", "5"):
        with pytest.raises(ValueError, match=r"time|unit"):
            by_gap(gap)
    with pytest.raises(ValueError, match="size 0 is not 1 or more"):
        by_size(0)
    with pytest.raises(ValueError, match="at least 1 byte"):
        by_delimiter(b"")
    with pytest.raises(ValueError, match="a length of 5 bytes at 1: it has 1 to 4 bytes at 0 or"):
        by_length(b"", at=1, extra=0, size=5)


def test_a_splitter_is_copied_in_the_middle_of_a_frame() -> None:
    splitter = by_length(b"U", at=1, extra=2).described(fields).splitter()
    splitter.push(0, b"U\x02a")
    for copied in (twin(splitter), pickle.loads(pickle.dumps(splitter))):
        assert copied.push(1, b"b") == [b"U\x02ab"]


class Kind(IntEnum):
    ASK = 1


def fields(frame: bytes) -> dict[str, Any]:
    if frame[1] != 2:
        raise ValueError("no such\nframe")
    inner = {"x": 1.5, "_io": None, "list": list(range(10)), "few": (1, 2)}
    return {"kind": Kind.ASK, "data": frame[2:], "none": b"", "inner": inner, "flag": True}


def test_a_description_shows_fields_by_name() -> None:
    rule = by_length(b"U", at=1, extra=2).described(fields)
    log = rule(Mark.TO_DEVICE)
    assert log(0, b"U\x02ab" + b"U\x00") == [
        b"kind=ASK data=6162 none=- inner=(x=1.5 list=[0, 1, 2, 3, 4, 5, 6, 7, ... (10)]"
        b" few=[1, 2]) flag=True",
        b"5500 (ValueError: no such frame)",
    ]


def test_without_a_description_frames_are_hex_in_groups_and_long_ones_are_cut() -> None:
    assert by_size(6)(Mark.TO_DEVICE)(0, b"abcdef") == [b"61626364 6566"]
    assert hex_text(bytes(40)) == " ".join(["00000000"] * 8) + " ... (40 bytes)"
    log = by_delimiter(b"\n")(Mark.FROM_DEVICE)
    assert log(0, b"hello\n\x01\xff\n") == [b"hello", b"01ff"]


def test_a_log_has_request_and_answer_each_with_its_own_time() -> None:
    log = WireLog(splitter=by_gap("2ms"))
    log.hear(1_000, Mark.TO_DEVICE, b"\x01")
    log.hear(2_000, Mark.TO_DEVICE, b"\x02")
    log.hear(6_000, Mark.FROM_DEVICE, b"\x03")
    log.hear(9_000, Mark.TO_DEVICE, b"\x04")
    seen = [(line.at_us, str(line.mark), line.data) for line in log.since(0)]
    assert seen == [(2_000, ">", b"0102"), (6_000, "<", b"03")]
    (begun,) = log.unfinished(by_gap=True)
    assert (begun.at_us, begun.data) == (9_000, b"04")
    assert log.unfinished() == ()


def test_a_transcript_shows_frames_of_an_undescribed_protocol_in_hex() -> None:
    with Bench(Lamp(b""), line=LineSettings(splitter=by_gap("5ms"))) as bench:
        bench.link.send(b"\x01\x02\x03\x04\x05")
        bench.run_for("20ms")
        bench.link.send(b"\x06")
        bench.run_for("20ms")
        bench.fault("truncate")
        bench.link.send(b"\x07\x08")
        bench.run_for("20ms")
        text = bench.transcript()
    assert "> 01020304 05" in text
    assert "< 01020304 05" in text
    assert "the host hears 07 where the device sent 0708" in text


def test_the_last_frame_ends_by_the_gap() -> None:
    with Bench(Lamp(b""), line=LineSettings(splitter=by_gap("5ms"))) as bench:
        answered = bench.on_line("0102")
        bench.link.send(b"\x01\x02")
        bench.run_for("1ms")  # it may be whole: no gap is over
        assert [line[9:] for line in bench.transcript().splitlines()] == [
            "lamp > 0102",
            "lamp < 0102",
        ]
        assert last_lines(bench, 20) == bench.transcript()
        assert bench.wait_until(answered, "1s")
        assert bench.now_us < 10_000
        assert len(bench.transcript().splitlines()) == 2


def test_a_frame_that_a_gap_breaks_off_is_shown_when_the_gap_is_over() -> None:
    with Bench(Lamp(b""), line=LineSettings(splitter=by_size(3, gap="5ms"))) as bench:
        bench.link.send(b"\x01\x02")
        bench.run_for("2ms")
        assert "lamp > 0102  (not ended)" in last_lines(bench, 20)
        bench.run_for("5ms")
        assert "lamp > 0102" in bench.transcript().splitlines()[0]


def test_an_emulator_hears_the_last_frame_when_the_gap_is_over() -> None:
    emulator = Emulator("lamp", Lamp(b""), line=LineSettings(splitter=by_gap("5ms")))
    emulator.send(0, b"\x01\x02")
    for _ in range(20):
        emulator.step()
    assert [line.data for line in emulator.log.since(0)] == [b"0102", b"0102"]


def test_a_struct_of_construct_is_a_description() -> None:
    construct = pytest.importorskip("construct")
    struct = construct.Struct(
        "header" / construct.Const(b"U"),
        "length" / construct.Int8ub,
        "command" / construct.Enum(construct.Int8ub, READ=1),
        "data" / construct.Bytes(construct.this.length - 1),
    )
    log = by_length(b"U", at=1, extra=2).described(struct)(Mark.TO_DEVICE)
    assert log(0, b"U\x03\x01ab") == [b"header=55 length=3 command=READ data=6162"]
    assert log(0, b"U\x00") == [
        b"5500 (StreamError: Error in path (parsing) -> command stream read less than specified )"
    ]
