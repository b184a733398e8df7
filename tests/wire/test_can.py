from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.can import CanFrame
from tickrig.wire.errors import FieldError, FramingError, WireError

lengths = st.integers(0, 8)


@st.composite
def frames(draw: st.DrawFn) -> CanFrame:
    extended = draw(st.booleans())
    can_id = draw(st.integers(0, 0x1FFF_FFFF if extended else 0x7FF))
    if draw(st.booleans()):
        return CanFrame(can_id, b"", True, extended, draw(lengths))
    return CanFrame(can_id, draw(st.binary(max_size=8)), extended=extended)


@given(frames())
def test_what_was_written_is_read_back(frame: CanFrame) -> None:
    assert CanFrame.parse(str(frame)) == frame.checked()


@pytest.mark.unmeasured
@given(st.text(max_size=30))
def test_any_other_text_is_a_wire_error(text: str) -> None:
    try:
        CanFrame.parse(text)
    except WireError:
        return
    assert "#" in text


def test_dots_between_bytes_are_read() -> None:
    assert CanFrame.parse("123#11.22") == CanFrame(0x123, b"\x11\x22")


def test_the_dlc_of_a_remote_frame_is_its_own() -> None:
    assert (CanFrame.parse("705#R1").dlc, CanFrame.parse("705#R").dlc) == (1, 0)
    assert CanFrame(1, b"abc").dlc == 3


@pytest.mark.parametrize(
    "text", ["705", "70#00", "705#0", "705#R9", "7055#00", "705#001122334455667788x"]
)
def test_a_wrong_text_says_what_it_should_look_like(text: str) -> None:
    with pytest.raises(FramingError, match="is not a frame like 705#7F"):
        CanFrame.parse(text)


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        (CanFrame(0x800), "CAN-ID 0x800 is not 11-bit"),
        (CanFrame(-1), "CAN-ID 0x-1 is not 11-bit"),
        (CanFrame(0x2000_0000, extended=True), "CAN-ID 0x20000000 is not 29-bit"),
        (CanFrame(1, bytes(9)), "a frame of 9 bytes, at most 8 fit"),
        (CanFrame(1, b"", True, False, 9), "a frame of 9 bytes, at most 8 fit"),
        (CanFrame(1, b"x", True), "a remote frame carries no data"),
    ],
)
def test_an_impossible_frame_is_told(frame: CanFrame, reason: str) -> None:
    with pytest.raises(FieldError, match=reason):
        frame.checked()


def test_more_than_eight_bytes_cannot_be_read() -> None:
    with pytest.raises(FieldError, match="at most 8 fit"):
        CanFrame.parse("705#001122334455667788")
