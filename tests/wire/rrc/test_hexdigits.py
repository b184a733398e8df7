from __future__ import annotations

import pytest

from tickrig.wire.errors import FieldError
from tickrig.wire.rrc.message import all_digits, read_hex, read_signed


def test_either_case_is_read() -> None:
    assert read_hex(b"fF") == 255


@pytest.mark.parametrize("digits", [b"1_", b" 1", b"+1", b"0x", b"g"])
def test_only_hex_digits_are_read(digits: bytes) -> None:
    with pytest.raises(FieldError):
        read_hex(digits)


def test_negative_numbers_are_in_twos_complement() -> None:
    assert [read_signed(d) for d in (b"FF", b"9c", b"64", b"80", b"7f")] == [
        -1,
        -100,
        100,
        -128,
        127,
    ]


def test_every_mixture_of_cases_is_listed() -> None:
    assert len(all_digits(1)) == 22
    assert len(all_digits(2)) == 484
