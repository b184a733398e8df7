from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.record_log import hear
from tickrig.host.canmon.model.trace import FrameTrace


def trace(text: str, capacity: int = 100) -> FrameTrace:
    found = FrameTrace(capacity)
    for record in hear(text):
        found.take(record)
    return found


def test_a_frame_tells_the_time_since_any_and_since_its_own_kind() -> None:
    rows = trace("1 181#\n1.1 182#\n1.3 181#").tail(3)
    assert [(row.since_us, row.gap_us) for row in rows] == [
        (None, None),
        (100_000, None),
        (200_000, 300_000),
    ]


def test_error_frames_are_a_kind_of_their_own() -> None:
    rows = trace("1 20000020#0000000000000000\n2 20000040#0000000000000000").tail(1)
    assert rows[0].gap_us == 1_000_000


def test_time_that_goes_back_is_no_time() -> None:
    assert trace("2 181#\n1 181#").tail(1)[0].since_us == 0


def test_old_frames_are_given_up_and_numbers_stay() -> None:
    found = trace("\n".join(f"{n} 181#{n:02X}" for n in range(10)), capacity=3)
    assert (found.first, found.count) == (7, 10)
    assert [row.number for row in found.rows(0, 9)] == [7, 8]
    assert [str(row.record.frame) for row in found.tail(2)] == ["181#08", "181#09"]


def test_a_cleared_trace_begins_with_number_0() -> None:
    found = trace("1 181#")
    found.clear()
    assert (found.count, found.tail(5)) == (0, [])
    row = found.take(hear("9 181#")[0])
    assert (row.number, row.since_us, row.gap_us) == (0, None, None)


@given(st.integers(1, 12), st.integers(0, 20), st.integers(-5, 25), st.integers(0, 25))
def test_rows_are_those_that_are_kept_and_asked_for(
    capacity: int, frames: int, begin: int, count: int
) -> None:
    found = trace("\n".join(f"{n} 181#" for n in range(frames)), capacity)
    kept = range(max(0, frames - capacity), frames)
    numbers = [row.number for row in found.rows(begin, count)]
    assert numbers == [number for number in kept if begin <= number < begin + count]
