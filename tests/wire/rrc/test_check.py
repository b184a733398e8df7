from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.wire.rrc.samples import SAMPLES
from tickrig.wire.errors import ChecksumError
from tickrig.wire.rrc.message import check_digit, strip_check


@pytest.mark.parametrize("line", SAMPLES)
def test_the_manuals_samples_agree(line: bytes) -> None:
    assert check_digit(line[:-1]) == line[-1:].upper()
    assert strip_check(line) == line[:-1]


@given(st.binary())
def test_what_was_appended_is_stripped(message: bytes) -> None:
    assert strip_check(message + check_digit(message)) == message
    assert strip_check(message + check_digit(message).lower()) == message


@pytest.mark.parametrize(
    "line", [b"", b"output1e008", b"hellox", b"output1e00 ", b"output1e00\xb7"]
)
def test_a_wrong_missing_or_odd_check_is_told(line: bytes) -> None:
    with pytest.raises(ChecksumError, match="expected"):
        strip_check(line)


def test_letter_case_is_not_seen() -> None:
    assert check_digit(b"watchdog64") == check_digit(b"WATCHDOG64")
