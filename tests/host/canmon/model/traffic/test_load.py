from __future__ import annotations

from tickrig.host.canmon.model.traffic import BusSecond, Load

S = 1_000_000


def load(*frames: tuple[int, int]) -> Load:
    """Count frames: time in microseconds, bits."""
    meter = Load(frames[0][0])
    for at_us, bits in frames:
        meter.take(at_us, bits)
    return meter


def test_a_frame_ends_the_second_before_its_own() -> None:
    meter = load((5 * S, 100), (5 * S + 999_999, 50))
    assert meter.take(6 * S, 70) == BusSecond(5 * S, 150)
    assert meter.end() == BusSecond(6 * S, 70)


def test_the_first_second_counts_while_it_lasts() -> None:
    assert load((0, 100)).row(10).latest == BusSecond(0, 100)


def test_the_latest_second_is_the_one_that_is_over() -> None:
    meter = load((0, 100), (S, 70))
    assert meter.row(S).latest == BusSecond(0, 100)
    assert meter.row(2 * S).latest == BusSecond(S, 70)


def test_a_silent_second_has_no_load() -> None:
    assert load((0, 100), (5 * S, 70)).row(5 * S).latest == BusSecond(4 * S, 0)
    assert load((0, 100)).row(9 * S).latest == BusSecond(8 * S, 0)


def test_the_peak_is_the_busiest_second() -> None:
    assert load((0, 10), (S, 90), (2 * S, 50)).row(2 * S).peak == BusSecond(S, 90)
    assert load((0, 10), (S, 90)).row(S).peak == BusSecond(S, 90)


def test_silent_seconds_count_for_the_mean() -> None:
    assert load((0, 100), (3 * S, 100)).row(3 * S).mean_bit_s == 50


def test_a_frame_that_goes_back_counts_for_the_open_second() -> None:
    meter = load((0, 100), (3 * S, 100), (S, 100))
    assert meter.end() == BusSecond(3 * S, 200)
