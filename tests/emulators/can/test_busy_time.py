from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tickrig.emulators.can.transmission_outcomes import KEPT_SPANS, BusyTime

frames = st.lists(st.tuples(st.sampled_from((0, 0, 1, 30)), st.integers(1, 50)), max_size=20)


@given(frames, st.integers(0, 300), st.integers(1, 400))
def test_it_counts_what_a_plain_list_of_frames_does(
    noted: list[tuple[int, int]], first: int, length: int
) -> None:
    busy, plain, at = BusyTime(), list[tuple[int, int]](), 0
    for gap, frame in noted:
        plain.append((at + gap, at + gap + frame))
        at += gap + frame
        busy.note(*plain[-1])
    present, now = (at, at + 40), first + length
    known = {unit for since, until in (*plain, present) for unit in range(since, until)}
    share = 1_000 * len(known & set(range(first, now))) // length
    assert busy.permille(first, now, present) == share


def test_a_full_bus_is_one_span_and_old_ones_are_forgotten() -> None:
    busy = BusyTime()
    for at in range(0, 3 * KEPT_SPANS):
        busy.note(at, at + 1)
    assert busy.permille(0, 3 * KEPT_SPANS, (0, 0)) == 1_000
    for at in range(3 * KEPT_SPANS, 6 * KEPT_SPANS, 2):
        busy.note(at + 1, at + 2)
    assert busy.permille(0, 3 * KEPT_SPANS, (0, 0)) == 0


def test_no_time_has_no_share() -> None:
    assert BusyTime().permille(5, 5, (0, 0)) == 0


def test_the_latest_32_768_spans_are_kept() -> None:
    busy, spans = BusyTime(), 32_768
    for at in range(0, 2 * (spans + 2), 2):
        busy.note(at + 1, at + 2)
    assert busy.permille(0, 2 * (spans + 1), (0, 0)) == 499
