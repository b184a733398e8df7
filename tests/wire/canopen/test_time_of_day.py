from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.canopen.datatypes import DAY_MS, TimeOfDay
from tickrig.wire.errors import FieldError, FramingError, WireError

TIMES = st.builds(TimeOfDay, st.integers(0, DAY_MS - 1), st.integers(0, 0xFFFF))


def test_the_time_of_check_sy_11_is_read() -> None:
    assert TimeOfDay.parse(bytes.fromhex("B0A429043143")) == TimeOfDay(69_838_000, 17_201)


@given(TIMES)
def test_what_was_written_can_be_read(time: TimeOfDay) -> None:
    assert TimeOfDay.parse(time.encode()) == time


def test_the_reserved_bits_are_ignored() -> None:
    assert TimeOfDay.parse(bytes.fromhex("B0A429F43143")) == TimeOfDay(69_838_000, 17_201)


@given(st.binary(max_size=8))
def test_any_bytes_are_a_time_or_refused(data: bytes) -> None:
    try:
        assert TimeOfDay.parse(data).encode()[4:] == data[4:]
    except WireError:
        assert len(data) != 6 or int.from_bytes(data[:4], "little") & 0xFFF_FFFF >= DAY_MS


@pytest.mark.parametrize("time", [TimeOfDay(DAY_MS, 0), TimeOfDay(-1, 0), TimeOfDay(0, 65_536)])
def test_an_impossible_time_is_not_written(time: TimeOfDay) -> None:
    with pytest.raises(FieldError):
        time.encode()


def test_a_time_of_another_length_is_refused() -> None:
    with pytest.raises(FramingError, match="5 bytes"):
        TimeOfDay.parse(bytes(5))


@given(TIMES, st.integers(0, 10**12), st.integers(0, 10**12))
def test_time_adds_up(time: TimeOfDay, first_ms: int, second_ms: int) -> None:
    step_by_step = time.after(first_ms * 1_000).after(second_ms * 1_000)
    assert step_by_step == time.after((first_ms + second_ms) * 1_000)
