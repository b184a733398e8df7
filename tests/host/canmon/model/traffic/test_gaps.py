from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canmon.model.traffic import GapRow, Gaps, bucket_of, bucket_range, quantile

TIMES = st.integers(0, 1 << 52)


def row(*gaps_us: int) -> GapRow | None:
    gaps = Gaps()
    for gap_us in gaps_us:
        gaps.take(gap_us)
    return gaps.row()


def test_gaps_have_a_shortest_a_longest_and_a_mean() -> None:
    found = row(100, 120, 90)
    assert found is not None
    assert (found.min_us, found.mean_us, found.max_us) == (90, 103, 120)


def test_jitter_is_the_mean_change_from_gap_to_gap() -> None:
    found = row(100, 120, 90)
    assert found is not None
    assert found.jitter_us == (20 + 30) // 2


def test_without_a_gap_there_is_no_row() -> None:
    assert row() is None


def test_one_long_gap_in_a_hundred_is_not_in_p99_but_two_are() -> None:
    one, two = row(*[100] * 99, 5_000), row(*[100] * 98, 5_000, 5_000)
    assert one is not None
    assert two is not None
    assert (one.p99_us, two.p99_us) == (100, 5_000)


def test_frames_that_a_cycle_misses_are_counted() -> None:
    found = row(*[10_000] * 20, 30_000, 10_000, 20_000)
    assert found is not None
    assert (found.cycle_us, found.missed) == (10_000, 2 + 1)


def test_a_late_frame_is_not_a_missed_one() -> None:
    found = row(*[10_000] * 20, 14_000)
    assert found is not None
    assert found.missed == 0


def test_frames_without_a_rhythm_have_no_cycle() -> None:
    found = row(10, 200, 3_000, 40_000, 500)
    assert found is not None
    assert (found.cycle_us, found.missed) == (None, None)


def test_frames_at_one_time_have_no_cycle() -> None:
    found = row(0, 0, 0)
    assert found is not None
    assert found.cycle_us is None


@given(TIMES)
def test_a_time_is_in_its_bucket_which_is_narrow(time_us: int) -> None:
    low, high = bucket_range(bucket_of(time_us))
    assert low <= time_us <= high
    assert (high - low + 1) * 64 <= max(64, low)


@given(TIMES)
def test_buckets_follow_each_other(time_us: int) -> None:
    assert bucket_of(bucket_range(bucket_of(time_us))[1] + 1) == bucket_of(time_us) + 1


@given(st.lists(TIMES, min_size=1), st.integers(1, 1_000))
def test_a_quantile_is_the_bucket_of_the_value_at_its_rank(
    times_us: list[int], per_mille: int
) -> None:
    counts: dict[int, int] = {}
    for time_us in times_us:
        counts[bucket_of(time_us)] = counts.get(bucket_of(time_us), 0) + 1
    rank = -(-len(times_us) * per_mille // 1_000)
    assert quantile(counts, per_mille) == bucket_of(sorted(times_us)[rank - 1])
