from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.device.canopen.ds401 import Converter

VOLTS = Converter("v", "V", low=-10.0, high=10.0, low_raw=-32768, high_raw=32767)


@pytest.mark.parametrize(
    ("volt", "counts"), [(-10.0, -32768), (0.0, 0), (10.0, 32767), (99.0, 32767), (-99.0, -32768)]
)
def test_a_bipolar_converter_is_limited_to_its_range(volt: float, counts: int) -> None:
    assert VOLTS.counts(volt) == counts


@pytest.mark.parametrize("counts", [-(2**40), 2**40])
def test_counts_beyond_the_range_are_its_ends(counts: int) -> None:
    assert VOLTS.quantity(counts) == (10.0 if counts > 0 else -10.0)


@given(st.integers(-32768, 32767))
def test_counts_come_back(counts: int) -> None:
    assert VOLTS.counts(VOLTS.quantity(counts)) == counts


@pytest.mark.parametrize(
    ("low", "high", "raw", "shift", "text"),
    [
        (5.0, 5.0, 4095, 3, r"5\.0\.\.5\.0 V is no range"),
        (float("nan"), 5.0, 4095, 3, "is no range"),
        (0.0, 5.0, 0, 3, "is no range"),
        (0.0, 5.0, 4095, 4, "counts do not fit into 16 bit"),
    ],
)
def test_an_impossible_converter_is_refused(
    low: float, high: float, raw: int, shift: int, text: str
) -> None:
    with pytest.raises(ValueError, match=text):
        Converter("v", "V", low=low, high=high, high_raw=raw, shift=shift)
