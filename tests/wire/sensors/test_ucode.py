"""Lines of a ucode reader. The protocol is ours: docs/reference/rtc/tkernel.md is its source."""

from __future__ import annotations

from binascii import crc_hqx

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.errors import ChecksumError, FieldError, FramingError, WireError
from tickrig.wire.ucode import HIGHEST, LineType, UcodeLine, parse_line, parse_ucode

DOOR = "00001C00000000000001000000000001"
GOLDEN = {
    b"$UI,1,3000,90,1*EB02\n": UcodeLine(LineType.READER, (1, 3_000, 90, 1)),
    b"$UC,12,00001C00000000000001000000000001,67*18FB\n": UcodeLine(LineType.UCODE, (12, DOOR, 67)),
    b"$UR,7,0*2FB5\n": UcodeLine(LineType.ROUND, (7, 0)),
    b"$UL,65535*7B14\n": UcodeLine(LineType.LIGHT, (65_535,)),
    b"$UE*E92B\n": UcodeLine(LineType.REFUSED, ()),
}


def summed(body: bytes) -> bytes:
    """Return a line without its end, whatever it says."""
    return b"$%s*%04X" % (body, crc_hqx(body, 0))


@pytest.mark.parametrize(("line", "value"), GOLDEN.items())
def test_a_line_is_written_and_read(line: bytes, value: UcodeLine) -> None:
    assert value.encode() == line
    assert parse_line(line.rstrip()) == value


def test_a_ucode_is_128_bits_in_hex() -> None:
    assert parse_ucode(DOOR.lower()) == DOOR
    for text in ("", DOOR[1:], f"{DOOR}0", "g" * 32, "0" * 31 + "٣"):
        with pytest.raises(FieldError, match="is not 32 hex digits"):
            parse_ucode(text)
    with pytest.raises(FieldError, match=r"ucode '0{40}\.\.\.' is not"):
        parse_ucode("0" * 1_000)


@pytest.mark.parametrize(
    ("line", "error", "told"),
    [
        (b"", FramingError, "no line of a ucode reader"),
        (b"$UR,7,0", FramingError, "no line"),
        (b"$UR,7,0*0001", ChecksumError, "CRC 0001 of b'UR,7,0' is 2FB5"),
        (summed(b"UX"), FieldError, "no kind of line: 'UX'"),
        (summed(b"UR,7"), FieldError, "UR has 2 fields, not 1"),
        (summed(b"UR,7,x"), FieldError, "'x' is no number of 0..99"),
        (summed(b"UR,7,"), FieldError, "'' is no number of 0..99"),
        (summed(b"UR,7,000"), FieldError, "'000' is no number of 0..99"),
        (summed(b"UR,65536,1"), FieldError, "UR: 65536 is not in 0..65535"),
        (summed(b"UC,1,ABC,5"), FieldError, "ucode 'ABC' is not 32 hex digits"),
    ],
)
def test_what_is_no_line_is_refused(line: bytes, error: type[WireError], told: str) -> None:
    with pytest.raises(error, match=told):
        parse_line(line)


@pytest.mark.parametrize(
    ("line_type", "fields", "told"),
    [
        (LineType.ROUND, (), "UR has 2 fields, not 0"),
        (LineType.ROUND, (1, DOOR), "is out of its place"),
        (LineType.UCODE, (1, 2, 3), "UC: 2 is out of its place"),
        (LineType.LIGHT, (-1,), "UL: -1 is not in 0..65535"),
    ],
)
def test_a_line_has_the_fields_of_its_kind(
    line_type: LineType, fields: tuple[int | str, ...], told: str
) -> None:
    with pytest.raises(FieldError, match=told):
        UcodeLine(line_type, fields)


@pytest.mark.hypothesis
@given(st.data(), st.sampled_from(LineType))
def test_what_is_written_is_read(data: st.DataObject, kind: LineType) -> None:
    def field(limit: int | None) -> st.SearchStrategy[int | str]:
        if limit is None:
            return st.integers(0, 2**128 - 1).map("{:032X}".format)
        return st.integers(0, limit)

    line = UcodeLine(kind, data.draw(st.tuples(*map(field, HIGHEST[kind]))))
    assert parse_line(line.encode()[:-1]) == line


@pytest.mark.hypothesis
@given(st.sampled_from(sorted(GOLDEN)), st.integers(0, 60), st.integers(0, 255))
def test_a_flipped_octet_is_found(line: bytes, at: int, octet: int) -> None:
    line = line.rstrip()
    spoilt = line[: at % len(line)] + bytes([octet]) + line[at % len(line) + 1 :]
    if spoilt != line:
        with pytest.raises(WireError):
            parse_line(spoilt)


@pytest.mark.hypothesis
@given(st.binary(max_size=60))
def test_noise_is_no_line(noise: bytes) -> None:
    with pytest.raises(WireError):
        parse_line(noise.replace(b"$", b""))
