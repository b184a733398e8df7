"""The frame length against a calculation that shares nothing with it."""

from __future__ import annotations

import random

import pytest

from tickrig.wire import can as can_bits
from tickrig.wire.can import KEPT_HEADS, CanFrame, frame_bits


def stream(frame: CanFrame) -> str:
    """Write the bits from start of frame to the last data bit (ISO 11898-1, frame formats)."""
    rtr, data = f"{frame.remote:b}", "".join(f"{byte:08b}" for byte in frame.data)
    if frame.extended:
        ident = f"{frame.can_id:029b}"
        return f"0{ident[:11]}11{ident[11:]}{rtr}00{frame.dlc:04b}{data}"
    return f"0{frame.can_id:011b}{rtr}00{frame.dlc:04b}{data}"


def crc15(bits: str) -> str:
    """Divide bit by bit, as the shift register of a controller does."""
    register = 0
    for bit in bits:
        inverted = int(bit) ^ register >> 14
        register = register << 1 & 0x7FFF
        if inverted:
            register ^= 0x4599
    return f"{register:015b}"


def stuffed(bits: str) -> str:
    out = ""
    for bit in bits:
        out += bit
        if out.endswith(("00000", "11111")):
            out += "01"[bit == "0"]
    return out


def counted(frame: CanFrame) -> int:
    bits = stream(frame)
    delimiters_ack_and_end_of_frame, interframe_space = 3 + 7, 3
    on_the_bus = stuffed(bits + crc15(bits))
    assert "000000" not in on_the_bus
    assert "111111" not in on_the_bus
    return len(on_the_bus) + delimiters_ack_and_end_of_frame + interframe_space


def random_frames(count: int) -> list[CanFrame]:
    """Draw frames in which long runs are not rare."""
    chance, made = random.Random(11898), []
    for _ in range(count):
        extended, remote = chance.random() < 0.4, chance.random() < 0.2
        can_id = chance.getrandbits(29 if extended else 11)
        can_id &= chance.choice([-1, -1, 0, 0xF, 0x7C0, 0x1FFF_0000])
        length = chance.randrange(9)
        data = bytes(chance.choice([0, 0xFF, chance.getrandbits(8)]) for _ in range(length))
        made.append(
            CanFrame(can_id, b"" if remote else data, remote, extended, length if remote else 0)
        )
    return made


@pytest.mark.unmeasured
def test_ten_thousand_random_frames_are_as_long_as_counted_bit_by_bit() -> None:
    for frame in random_frames(10_000):
        assert frame_bits(frame) == counted(frame), str(frame.checked())


@pytest.mark.parametrize(
    ("text", "least", "most"),
    [("555#", 47, 47 + 8), ("7FF#FFFFFFFFFFFFFFFF", 111, 111 + 24), ("15555555#R8", 67, 67 + 13)],
)
def test_the_length_is_between_the_known_limits(text: str, least: int, most: int) -> None:
    assert least <= frame_bits(CanFrame.parse(text)) <= most


def test_five_equal_bits_at_the_end_of_the_crc_are_stuffed_too() -> None:
    ended = [f for f in random_frames(2_000) if crc15(stream(f))[-5:] in ("00000", "11111")]
    assert ended
    for frame in ended:
        assert frame_bits(frame) == counted(frame)


def test_more_identifiers_than_are_kept_are_as_long_as_counted() -> None:
    frames = [CanFrame(can_id, extended=True) for can_id in range(2 * KEPT_HEADS + 1)]
    bits = [frame_bits(frame) for frame in frames]
    assert len(can_bits._heads) <= KEPT_HEADS
    assert bits[-50:] == [counted(frame) for frame in frames[-50:]]
    assert [frame_bits(frame) for frame in frames[:50]] == bits[:50]
