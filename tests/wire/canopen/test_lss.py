from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.canopen.lss import FastScan, LssCommand, message, number_of

U32 = st.integers(0, 0xFFFF_FFFF)
U8 = st.integers(0, 0xFF)


def test_messages_of_the_conformance_checks_are_written() -> None:
    assert message(LssCommand.SWITCH_VENDOR, 0xAB01).hex() == "4001ab0000000000"
    assert message(LssCommand.SWITCHED).hex() == "4400000000000000"
    assert FastScan(0, 0x80, 0, 0).encode().hex() == "5100000000800000"


@given(st.sampled_from(LssCommand), U32)
def test_a_number_that_was_written_can_be_read(command: LssCommand, number: int) -> None:
    assert number_of(message(command, number)) == number


@given(U32, U8, U8, U8)
def test_a_fastscan_that_was_written_can_be_read(
    number: int, bit: int, sub: int, then: int
) -> None:
    request = FastScan(number, bit, sub, then)
    assert FastScan.parse(request.encode()) == request


@given(st.binary(min_size=8, max_size=8))
def test_any_eight_bytes_are_read(data: bytes) -> None:
    assert FastScan.parse(data).encode()[1:] == data[1:]
    assert number_of(data) == int.from_bytes(data[1:5], "little")
