"""SCIP 2.0: examples of the specification and of a real sensor, round trips, noise."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.errors import ChecksumError, FieldError, FramingError, WireError
from tickrig.wire.scip import (
    MOST_BYTES,
    SIZES,
    Command,
    Reply,
    ReplySplitter,
    Specification,
    encode_lines,
    encode_number,
    encode_numbers,
    encode_scan,
    parse_lines,
    parse_number,
    parse_numbers,
    parse_scan,
    with_sum,
    without_sum,
)

SPECIFIED = [(1_234, b"CB"), (5_432, b"1Dh"), (16_000_000, b"m2@0")]
"""SCIP 2.0 (C-42-03320B), data encoding and decoding."""

TOLD = """\
VEND:Hokuyo Automatic Co.,Ltd.;[
PROD:SOKUIKI Sensor URG-04LX;[
FIRM:3.1.00(18/Jan./2007);`
PROT:SCIP 2.0;N
SERI:H0614967;V
MODL:URG-04LX(Hokuyo Automatic Co.,Ltd.);N
DMIN:20;4
DMAX:5600;_
ARES:1024;\\
AMIN:44;7
AMAX:725;o
AFRT:384;6
SCAN:600;e
LASR:OFF;7
SCSP:Initial(600[rpm])<-Default setting by user;A
MESM:IDLE;:
SBPS:19200[bps]<-Default setting by user;A
TIME:081615;N
STAT:Sensor works well.;8
""".splitlines()
"""A sensor's answers to VV, PP and II (URG network, obtain status information)."""

distances = st.lists(st.integers(0, 4_095), max_size=200)


@pytest.mark.parametrize(("value", "data"), SPECIFIED)
def test_numbers_are_coded_as_specified(value: int, data: bytes) -> None:
    assert encode_number(value, len(data)) == data
    assert parse_number(data) == value


@pytest.mark.parametrize("line", TOLD)
def test_lines_of_a_real_sensor_have_their_sums(line: str) -> None:
    (key, value), *_ = parse_lines([line.encode()]).items()
    assert encode_lines({key: value}) == (line.encode(),)


def test_the_specification_of_a_real_sensor_is_read() -> None:
    lines = tuple(line.encode() for line in TOLD[5:13])
    told = Specification.parse(lines)
    assert told == Specification(
        "URG-04LX(Hokuyo Automatic Co.,Ltd.)", 20, 5_600, 1_024, 44, 725, 384, 600
    )
    assert told.lines == lines


@pytest.mark.parametrize("value", [-1, 4_096])
def test_a_number_that_does_not_fit_is_refused(value: int) -> None:
    with pytest.raises(FieldError, match=f"{value} does not fit into 2 characters"):
        encode_number(value, 2)


@pytest.mark.parametrize("data", [b"/", b"p", b"0 "])
def test_a_character_that_carries_no_number_is_refused(data: bytes) -> None:
    with pytest.raises(FieldError, match=r"is not in 0x30\.\.0x6f"):
        parse_number(data)


@given(st.binary(min_size=1), st.integers(0, 255))
def test_a_changed_character_is_noticed(data: bytes, code: int) -> None:
    line = with_sum(data)
    assert without_sum(line) == data
    if code & 0x3F != data[0] & 0x3F:
        with pytest.raises(ChecksumError):
            without_sum(bytes((code,)) + line[1:])


def test_an_empty_line_has_no_sum() -> None:
    with pytest.raises(ChecksumError):
        without_sum(b"")


@given(st.integers(0, 2**24 - 1), distances, st.sampled_from([2, 3]))
def test_scans_survive_coding(time_ms: int, numbers: list[int], width: int) -> None:
    lines = encode_scan(time_ms, numbers, width)
    assert all(len(line) <= 65 for line in lines)
    assert parse_scan(lines, width) == (time_ms, tuple(numbers))


@given(st.integers(1, 4), st.data())
def test_a_character_carries_six_bits_and_0_is_the_lowest(width: int, data: st.DataObject) -> None:
    most = (1 << 6 * width) - 1
    numbers = data.draw(st.lists(st.integers(0, most) | st.just(most), max_size=9))
    shifts = range(6 * (width - 1), -1, -6)
    codes = bytes(0x30 + (number >> shift & 0x3F) for number in numbers for shift in shifts)
    assert encode_numbers(numbers, width) == codes
    assert parse_numbers(codes, width) == tuple(numbers)


@pytest.mark.parametrize("lines", [(), (with_sum(b"000"),), (with_sum(b"0000"), with_sum(b"0000"))])
def test_a_scan_cut_short_is_refused(lines: tuple[bytes, ...]) -> None:
    with pytest.raises(WireError):
        parse_scan(lines, 3)


@pytest.mark.parametrize(
    ("line", "error"), [(b"DMIN;4", FramingError), (b"20", FramingError), (b"A:1;0", ChecksumError)]
)
def test_a_line_that_tells_nothing_is_refused(line: bytes, error: type[WireError]) -> None:
    with pytest.raises(error):
        parse_lines([line])


def test_a_specification_without_a_number_is_refused() -> None:
    with pytest.raises(FieldError, match="DMAX 'far' is not a whole number"):
        Specification.parse(encode_lines({"DMIN": "20", "DMAX": "far"}))


@pytest.mark.parametrize("symbol", SIZES)
def test_commands_are_cut_into_their_parameters(symbol: str) -> None:
    command = Command(symbol, "1" * sum(SIZES[symbol]), ";a b")
    assert Command.parse(command.encode()[:-1]) == command
    assert tuple(map(len, command.fields)) == SIZES[symbol]


@given(st.binary().filter(lambda data: b"\n" not in data))
def test_any_line_comes_back_as_echo(line: bytes) -> None:
    assert Command.parse(line).echo == line


@given(st.lists(st.integers(1, 9), min_size=1), st.lists(st.binary(max_size=30), max_size=5))
def test_replies_are_found_however_they_are_cut(sizes: list[int], datas: list[bytes]) -> None:
    lines = tuple(with_sum(data.replace(b"\n", b"")) for data in datas)
    lines = tuple(line for line in lines if line not in (b"", b"\n"))
    replies = [Reply(b"GD0000076800", "00", lines), Reply(b"BM;x", "02")]
    data = b"".join(reply.encode() for reply in replies)
    splitter, found, at = ReplySplitter(), list[Reply](), 0
    while at < len(data):
        size = sizes[at % len(sizes)]
        found += splitter.push(data[at : at + size])
        at += size
    assert (found, splitter.garbled) == (replies, 0)


@pytest.mark.parametrize("data", [b"BM\n\n", b"BM\n00Q\n\n", b"BM\n00\n\n", b"BM\n\xff\xffn\n\n"])
def test_what_is_no_reply_is_counted(data: bytes) -> None:
    splitter = ReplySplitter()
    assert splitter.push(data + b"QT\n00P\n\n") == [Reply(b"QT", "00")]
    assert splitter.garbled == 1


def test_noise_without_an_end_does_not_fill_the_memory() -> None:
    splitter = ReplySplitter()
    assert splitter.push(bytes(MOST_BYTES + 1)) == []
    assert splitter.push(b"QT\n00P\n\n") == [Reply(b"QT", "00")]
    assert splitter.garbled == 1


@given(st.binary())
def test_any_noise_is_survived(data: bytes) -> None:
    ReplySplitter().push(data + b"\n\n")


def test_the_last_answer_in_scip_1_has_no_sum() -> None:
    assert Reply.parse(b"SCIP2.0\n0") == Reply(b"SCIP2.0", "0")
