from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.text.bench_header import (
    PREFIX,
    BenchHeader,
    DeviceEntry,
    Place,
    WireEntry,
    WireType,
    parse_bench_header,
)
from tickrig.host.text.bench_record import BenchParser, BenchRecord, change_text
from tickrig.host.text.trace import Mark, TraceError
from tickrig.wire.can import CanFrame

HEADER = BenchHeader(
    {
        "rrc": DeviceEntry("line", "rrc", {"version": "1", "n": 2, "x": 0.5, "no": None}),
        "left": DeviceEntry("bus", "drive.eds", {}, 5, "ab12", {"node_id": 6}),
        "mine": DeviceEntry("line"),
    },
    {"line": WireEntry(WireType.SERIAL, {"baud": 9600}), "bus": WireEntry(WireType.CAN)},
    seed=7,
    place=Place.PORT,
)


def parsed(*lines: str) -> list[BenchRecord]:
    return list(BenchParser(HEADER).parse(lines))


def test_a_header_comes_back() -> None:
    assert parse_bench_header(HEADER.encode()) == HEADER
    assert HEADER.encode().isascii()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("hello", "line 1 is not '# tickrig-trace v2"),
        ("[]", "line 1: the header is no JSON object: \\[\\]"),
        ("{}", "line 1: the header has no wires"),
        ('{"wires": {}, "devices": []}', "the header has no devices, or a bad one: \\[\\]"),
        ('{"wires": {"w": 5}, "devices": {}}', "wire 'w' is no JSON object: 5"),
        ('{"wires": {"w": {"type": "air"}}, "devices": {}}', "'air' is not a valid WireType"),
        ('{"wires": {}, "devices": {"a": {"wire": "w"}}}', "device a is on wire 'w'"),
        ('{"wires": {}, "devices": {"a b": {"wire": "w"}}}', "'a b' cannot stand in a trace"),
        (
            '{"wires": {}, "devices": {}, "seed": true}',
            "has no seed, or a bad one: True",
        ),
        ('{"wires": {}, "devices": {}, "place": "moon"}', "'moon' is not a valid Place"),
        (
            '{"wires": {"w": {"type": "can"}},'
            ' "devices": {"a": {"wire": "w", "config": {"b": []}}}}',
            "device 'a': 'b' is \\[\\]",
        ),
    ],
)
def test_what_is_no_header_is_refused(line: str, message: str) -> None:
    with pytest.raises(TraceError, match=message):
        parse_bench_header(line if line == "hello" else PREFIX + line)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("", "line 2: not 'SECONDS NAME MARK TEXT': ''"),
        ("0.1 rrc > x", "not 'SECONDS NAME MARK TEXT'"),
        ("0.100000 rrc ? x", "not 'SECONDS NAME MARK TEXT'"),
        ("0.100000 who > x", "line 2: no device who in the header"),
        ("0.100000 rrc > \\q", "is not ASCII"),
        ("0.100000 left > 605", "'605' is not a frame like"),
        ("0.100000 left > 900#", "CAN-ID 0x900 is not 11-bit"),
        ("0.100000 left ! a", "'a' is not NAME=VALUE"),
        ("0.100000 left ! a=b", "line 2: Expecting value"),
        ("0.100000 left ! a=true", "'a=true' is no number and no string"),
        ("0.100000 left ! a=1e999", "'a=1e999' is no number and no string"),
        ("0.100000 who ~ drop", "no such wire or device in the header, or 'drop' is no fault"),
        ("0.100000 bus ~ a b", "no such wire or device in the header, or 'a b' is no fault"),
    ],
)
def test_what_is_no_line_is_refused(line: str, message: str) -> None:
    with pytest.raises(TraceError, match=message):
        parsed(line)


def test_time_does_not_run_backwards_and_nothing_follows_the_end() -> None:
    with pytest.raises(TraceError, match="line 3 is earlier"):
        parsed("0.200000 rrc > a", "0.100000 rrc > a")
    with pytest.raises(TraceError, match="line 3 is earlier than the line above it, or behind"):
        parsed("0.200000 .", "0.300000 rrc > a")


VALUES = st.one_of(
    st.integers(-(10**18), 10**18),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text(max_size=20),
)
NAMES = st.sampled_from(["stick", "0x6000:1", "0x1008"])


@given(NAMES, VALUES)
def test_any_value_that_is_set_comes_back(name: str, value: float | str) -> None:
    text = change_text(name, value)
    assert text.isascii()
    (record,) = parsed(BenchRecord(1, "rrc", Mark.PHYSICAL, text=text).encode())
    assert record.change == (name, value)
    assert json.loads(text.partition("=")[2]) == value


def test_a_truth_value_is_a_number() -> None:
    assert change_text("key", True) == "key=1"


@given(st.binary(min_size=1), st.sampled_from([Mark.TO_DEVICE, Mark.FROM_DEVICE]))
def test_any_bytes_come_back(data: bytes, mark: Mark) -> None:
    record = BenchRecord(12_345_678, "rrc", mark, data, line=2)
    assert parsed(record.encode()) == [record]


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_any_frame_comes_back(can_id: int, data: bytes) -> None:
    record = BenchRecord(1, "left", Mark.FROM_DEVICE, CanFrame(can_id, data), line=2)
    assert parsed(record.encode()) == [record]
