"""CAN FD frames: candump's notation, and their length against a bit stream written out."""

from __future__ import annotations

from itertools import groupby

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.can import BRS, ESI, FD_LENGTHS, CanFrame, FdBits, FdFrame, fd_bits, parse_sent
from tickrig.wire.errors import FieldError, FramingError

DATA = st.sampled_from(FD_LENGTHS).flatmap(
    lambda length: st.one_of(
        st.binary(min_size=length, max_size=length),
        st.sampled_from([bytes(length), b"\xff" * length, b"\xf0" * length, b"\x07" * length]),
    )
)
FRAMES = st.one_of(
    st.builds(FdFrame, st.integers(0, 0x7FF), DATA, st.just(False), st.integers(0, 3)),
    st.builds(FdFrame, st.integers(0, 0x1FFF_FFFF), DATA, st.just(True), st.integers(0, 3)),
)


@given(frame=FRAMES)
def test_what_is_written_is_read_again(frame: FdFrame) -> None:
    assert FdFrame.parse(str(frame)) == frame == frame.checked()
    assert FD_LENGTHS[frame.dlc] == len(frame.data)
    assert (frame.brs, frame.esi, frame.remote) == (
        bool(frame.flags & BRS),
        bool(frame.flags & ESI),
        False,
    )


def test_data_are_filled_up_to_a_length_that_can_fd_has() -> None:
    assert str(FdFrame.parse("123##0" + "11" * 9)) == "123##0" + "11" * 9 + "000000"
    assert FdFrame(1, bytes(63)).checked().data == bytes(64)


def test_other_flags_are_passed_over_and_dots_too() -> None:
    assert FdFrame.parse("00000123##D11.22") == FdFrame(0x123, b"\x11\x22", True, BRS)


@pytest.mark.parametrize("text", ["123#11", "123##", "12##1", "123##111.2", "123##1R", "##1"])
def test_other_text_is_no_frame(text: str) -> None:
    with pytest.raises(FramingError, match="123##1AABB"):
        FdFrame.parse(text)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("800##1", "CAN-ID 0x800 is not 11-bit"),
        ("20000000##1", "CAN-ID 0x20000000 is not 29-bit"),
        ("123##1" + "00" * 65, "65 bytes, at most 64"),
    ],
)
def test_what_can_fd_does_not_have_is_refused(text: str, why: str) -> None:
    with pytest.raises(FieldError, match=why):
        FdFrame.parse(text)


@pytest.mark.parametrize("flags", [0, 1])
def test_a_frame_is_never_one_of_classic_can(flags: int) -> None:
    classic: object = CanFrame(1, b"", False, bool(flags))
    assert FdFrame(1, b"", False, flags) != classic


def written_out(frame: FdFrame) -> FdBits:
    """Write each bit of a frame, and count: independent of tables and of the automaton."""
    brs, esi = f"{frame.flags & 1}", f"{frame.flags >> 1}"
    if frame.extended:
        ident = f"{frame.can_id:029b}"
        head = f"0{ident[:11]}11{ident[11:]}0" + "10" + brs
    else:
        head = f"0{frame.can_id:011b}00" + "10" + brs
    plain = head + esi + f"{frame.dlc:04b}" + "".join(f"{byte:08b}" for byte in frame.data)
    sent, switched = "", 0
    for place, bit in enumerate(plain):
        sent += bit
        tail = [len(list(run)) for _, run in groupby(sent)][-1]
        if tail == 5 and place < len(plain) - 1:
            sent += "10"[int(bit)]
        if place == len(head) - 1:
            switched = len(sent)
    crc_bits = 4 + (17 if len(frame.data) <= 16 else 21)
    fixed = 1 + crc_bits // 4
    fast = len(sent) - switched + crc_bits + fixed
    slow = switched + len("D") + len("AD") + 7 + 3
    return FdBits(slow, fast) if frame.flags & BRS else FdBits(slow + fast, 0)


@given(frame=FRAMES)
def test_its_length_is_that_of_its_bits_written_out(frame: FdFrame) -> None:
    assert fd_bits(frame) == written_out(frame)


def test_the_longest_frames_have_the_known_bits_without_stuffing() -> None:
    """An identifier and data without five equal bits in a row: 17 + 5 + 512 + 32 + 13."""
    assert sum(fd_bits(FdFrame(0x555, b"\x55" * 64, flags=BRS))) == 17 + 5 + 512 + 32 + 13


@pytest.mark.parametrize("text", ["705#7F", "00000605#R", "123##1AABB", "00000123##0"])
def test_a_frame_to_send_is_of_the_kind_that_its_notation_says(text: str) -> None:
    frame = parse_sent(text)
    assert (str(frame), isinstance(frame, FdFrame)) == (text, "##" in text)
