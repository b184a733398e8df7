"""Time stamps of a driver on the clock of the host."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.links.can_link import StampClock


def test_frames_that_are_read_late_have_the_times_of_the_bus() -> None:
    clock = StampClock()
    assert clock.at_us(1_000.0, 0, 50) == 50
    late = [clock.at_us(1_000.0 + n / 10, 60, 1_300_000) for n in range(1, 13)]
    assert late == [50 + 100_000 * n + 20 * n for n in range(1, 13)]  # 20 us for the drift


def test_the_frame_that_was_read_fastest_says_how_far_the_clocks_are_apart() -> None:
    clock = StampClock()
    read = ((7.000, 9_000), (7.001, 9_200), (7.003, 12_100))
    assert [clock.at_us(stamp_s, 0, now_us) for stamp_s, now_us in read] == [9_000, 9_200, 11_200]


def test_a_clock_that_was_set_matters_only_while_the_host_is_late() -> None:
    for step_s in (-3_600.0, -0.3, 0.3, 3_600.0):
        clock = StampClock()
        clock.at_us(5_000.0, 0, 100)
        for n in range(1, 50):
            now_us = 100 + 10_000 * n
            at_us = clock.at_us(5_000.0 + step_s + n / 100, now_us - 10_000, now_us)
            assert now_us - 10_000 <= at_us <= now_us


@given(st.lists(st.tuples(st.floats(0, 1e9), st.integers(0, 10**6)), max_size=30))
def test_no_frame_is_of_before_the_last_look_nor_of_the_future(
    read: list[tuple[float, int]],
) -> None:
    clock, now_us = StampClock(), 0
    for stamp_s, passed_us in read:
        polled_us, now_us = now_us, now_us + passed_us
        assert polled_us <= clock.at_us(stamp_s, polled_us, now_us) <= now_us
