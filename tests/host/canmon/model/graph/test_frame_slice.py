from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tickrig.host.canmon.model.graph.series import FrameSlice, parse_slice

DATA = bytes.fromhex("0180FF7F0000C03F")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("181[0]", 1),
        ("181[1]s", -128),
        ("181[1.7]", 1),
        ("181[1.0]", 0),
        ("181[2.4+8]", 0xFF),
        ("181[0:2]", 0x8001),
        ("181[0:2]b", 0x0180),
        ("181[1:3]sb", -32513),
        ("181[4:8]f", 1.5),
        ("181[2:4]s*0.5+10", 0x7FFF * 0.5 + 10),
        ("181[0]/4-1", -0.75),
        ("181[0]*-2+5", 3),
        ("181[0:8]", int.from_bytes(DATA, "little")),
    ],
)
def test_a_slice_is_cut_out_and_scaled(text: str, value: float) -> None:
    assert parse_slice(text).value(DATA) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "value"),
    [("123[63]", 0x2A), ("123[60:64]", 0x2A000000), ("123[56:64]sb", 0x2A), ("123[63.1+5]", 21)],
)
def test_a_slice_reaches_into_64_bytes(text: str, value: int) -> None:
    assert parse_slice(text).value(bytes(63) + b"\x2a") == value
    assert parse_slice(text).value(bytes(8)) is None


def test_floats_may_be_big_endian() -> None:
    assert parse_slice("181[0:4]fb").value(struct.pack(">f", 2.5)) == 2.5
    assert parse_slice("181[0:8]fb").value(struct.pack(">d", 2.5)) == 2.5


def test_a_frame_that_is_too_short_has_no_value() -> None:
    assert parse_slice("181[2:4]").value(b"\1\2\3") is None
    assert parse_slice("181[2.3]").value(b"\1\2\3") == 0


def test_an_identifier_of_eight_digits_is_extended() -> None:
    assert parse_slice("00000181[0]").key == 0x8000_0181
    assert parse_slice("181[0]").key == 0x181


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("181", "is not ID[BYTES]TYPE"),
        ("181[100]", "is not ID[BYTES]TYPE"),
        ("181[4:4]", "has 0 bits from bit 32"),
        ("181[63.4+5]", "has 5 bits from bit 508; a signal has 1 to 64 of the 512"),
        ("181[64]", "has 8 bits from bit 512"),
        ("181[0:9]", "has 72 bits from bit 0; a signal has 1 to 64"),
        ("181[0:2]f", "has 16 bits; a float has 4 or 8 whole bytes"),
        ("181[0.4+8]b", "big-endian takes whole bytes"),
        ("181[0]*0", "has the factor 0"),
        ("FFF[0]", "CAN-ID 0xFFF is above 0x7FF"),
        ("181[0]x", "is not ID[BYTES]TYPE"),
    ],
)
def test_what_is_no_slice_is_refused(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said.replace("[", r"\[")):
        parse_slice(text)


@st.composite
def slices(draw: st.DrawFn) -> FrameSlice:
    first = draw(st.integers(0, 63))
    bits = draw(st.integers(1, 64 - first))
    kind = draw(st.sampled_from("us"))
    if draw(st.booleans()):
        first, bits = first // 8 * 8, max(8, bits // 8 * 8)
        return FrameSlice(1, False, first, min(bits, 64 - first), kind, True, 0.5, 1)
    return FrameSlice(1, False, first, bits, kind)


@given(slices(), st.binary(min_size=8, max_size=8))
def test_many_payloads_at_once_give_the_same(cut: FrameSlice, data: bytes) -> None:
    payload = np.array([int.from_bytes(data, "little")], np.uint64)
    assert cut.values(payload)[0] == pytest.approx(cut.value(data), rel=1e-15)


@example(bytes.fromhex("000000007F800001"), "[4:8]fb")
@given(st.binary(min_size=8, max_size=8), st.sampled_from(["[0:4]f", "[4:8]fb", "[0:8]f"]))
def test_many_floats_at_once_give_the_same(data: bytes, field: str) -> None:
    cut = parse_slice(f"181{field}")
    payload = np.array([int.from_bytes(data, "little")], np.uint64)
    assert str(float(cut.values(payload)[0])).strip("-") == str(cut.value(data)).strip("-")
