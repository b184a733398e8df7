from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.canopen.emcy import Emcy, EmcyCode, describe
from tickrig.wire.errors import FramingError

U16 = st.integers(0, 0xFFFF)
U8 = st.integers(0, 0xFF)


def test_an_emcy_of_the_conformance_checks_is_read() -> None:
    emcy = Emcy.parse(bytes.fromhex("3081110700000000"))
    assert emcy == Emcy(EmcyCode.HEARTBEAT, 0x11, b"\x07\x00\x00\x00\x00")


@given(U16, U8, st.binary(min_size=5, max_size=5))
def test_what_was_written_can_be_read(code: int, register: int, text: bytes) -> None:
    emcy = Emcy(code, register, text)
    assert Emcy.parse(emcy.encode()) == emcy


def test_a_text_is_cut_or_filled_up() -> None:
    assert Emcy(0, 0, b"1234567").encode() == bytes.fromhex("0000003132333435")
    assert Emcy(0, 0, b"1").encode() == bytes.fromhex("0000003100000000")


@given(st.binary(max_size=12))
def test_any_bytes_are_an_emcy_or_refused(data: bytes) -> None:
    if len(data) == 8:
        assert Emcy.parse(data).encode() == data
    else:
        with pytest.raises(FramingError, match="it has 8"):
            Emcy.parse(data)


@pytest.mark.parametrize("code", EmcyCode)
def test_every_code_has_a_text_of_its_own(code: EmcyCode) -> None:
    assert sum(describe(other) == describe(code) for other in EmcyCode) == 1


@pytest.mark.parametrize(
    ("code", "text"),
    [
        (0x8131, "life guard error or heartbeat error"),
        (0x81FF, "communication, generic error"),
        (0x2310, "current, CANopen device output side"),
        (0x2400, "current, generic error"),
        (0x7320, "position sensor (CiA 402)"),
        (0x7349, "sensor (CiA 402)"),
        (0x7900, "additional modules, generic error"),
        (0x8611, "following error (CiA 402)"),
        (0x00FF, "unknown"),
        (0xA000, "unknown"),
    ],
)
def test_a_code_without_a_text_has_that_of_its_class(code: int, text: str) -> None:
    assert describe(code) == text
