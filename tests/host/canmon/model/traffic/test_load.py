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
    assert meter.end(6 * S) == BusSecond(6 * S, 70)


def test_the_first_second_counts_while_it_lasts() -> None:
    assert load((0, 100)).row(S // 2, 0).latest == BusSecond(0, 100, S // 2)


def test_the_latest_second_is_the_one_that_is_over() -> None:
    meter = load((0, 100), (S, 70))
    assert meter.row(S, S).latest == BusSecond(0, 100)
    assert meter.row(2 * S, S).latest == BusSecond(S, 70)


def test_a_silent_second_has_no_load() -> None:
    assert load((0, 100), (5 * S, 70)).row(5 * S, 5 * S).latest == BusSecond(4 * S, 0)
    assert load((0, 100)).row(9 * S, 0).latest == BusSecond(8 * S, 0)


def test_the_peak_is_the_busiest_second() -> None:
    assert load((0, 10), (S, 90), (2 * S, 50)).row(2 * S, 2 * S).peak == BusSecond(S, 90)
    assert load((0, 10), (S, 90)).row(S, S).peak == BusSecond(S, 90)


def test_silent_seconds_count_for_the_mean() -> None:
    assert load((0, 100), (3 * S, 100)).row(3 * S, 3 * S).mean_bit_s == 66


def test_a_frame_that_goes_back_counts_for_the_open_second() -> None:
    meter = load((0, 100), (3 * S, 100), (S, 100))
    assert meter.end(3 * S) == BusSecond(3 * S, 200)


def test_the_mean_is_the_bits_through_the_time_of_the_log() -> None:
    assert load((0, 1000), (1_003_000, 3)).row(1_003_000, 1_003_000).mean_bit_s == 1_000
    assert load((0, 100), (490_000, 390)).row(490_000, 490_000).mean_bit_s == 1_000
    assert load((0, 100)).row(0, 0).mean_bit_s == 100


def test_a_log_shorter_than_a_second_has_the_peak_of_its_own_time() -> None:
    row = load((0, 100), (490_000, 390)).row(490_000, 490_000, ended=True)
    assert row.peak == BusSecond(0, 490, 490_000)
    assert row.peak.bit_s == row.mean_bit_s == row.latest.bit_s == 1_000


def test_half_a_second_at_the_end_has_the_peak_of_its_own_time() -> None:
    meter = load((0, 100), (S, 200), (1_500_000, 200))
    assert meter.row(1_500_000, 1_500_000, ended=True).peak == BusSecond(S, 400, 500_000)
    assert meter.end(1_500_000).bit_s == 800
    assert meter.row(1_500_000, 1_500_000).peak == BusSecond(S, 400)  # more may follow
    assert meter.end(9 * S) == BusSecond(S, 400)


def test_a_burst_at_the_end_counts_as_part_of_a_second() -> None:
    meter = load((0, 100), (S, 50), (1_000_300, 40))
    assert meter.row(1_000_300, 1_000_300, ended=True).peak == BusSecond(0, 100)
    assert meter.end(1_000_300) == BusSecond(S, 90)
