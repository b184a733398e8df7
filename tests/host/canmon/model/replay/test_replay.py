from __future__ import annotations

from itertools import islice
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.verbs.play import Lateness, ReplayPlan
from tickrig.wire.can import NO_ACK, CanFrame

SYNC = CanFrame(0x080)
LOG = [Record(5_000_000 + n * 10_000, "can0", CanFrame(0x100 + n)) for n in range(5)]
BACK = {"can0": "vcan2"}.get


def planned(**options: Any) -> list[tuple[int, int]]:
    return [(due.at_us, due.frame.can_id - 0x100) for due in ReplayPlan(LOG, BACK, **options)]


def test_a_log_is_sent_with_its_own_gaps() -> None:
    plan = ReplayPlan(LOG, BACK)
    assert planned() == [(0, 0), (10_000, 1), (20_000, 2), (30_000, 3), (40_000, 4)]
    assert {due.channel for due in plan} == {"vcan2"}


def test_a_speed_shrinks_the_gaps() -> None:
    assert planned(speed=2)[-1] == (20_000, 4)
    assert planned(speed=0.5)[-1] == (80_000, 4)
    assert {at_us for at_us, _ in planned(speed=0)} == {0}


def test_a_span_is_cut_out() -> None:
    assert planned(from_us=15_000, to_us=35_000) == [(5_000, 2), (15_000, 3)]
    assert planned(from_us=10_000)[0] == (0, 1)


def test_loops_follow_each_other() -> None:
    assert planned(loops=2)[4:7] == [(40_000, 4), (40_000, 0), (50_000, 1)]
    assert planned(loops=3, to_us=100_000)[-1] == (240_000, 4)
    endless = ReplayPlan(LOG, BACK, loops=0)
    assert list(islice(endless, 501))[-1].at_us == 100 * 40_000


def test_an_endless_replay_of_one_frame_takes_time() -> None:
    endless = ReplayPlan(LOG[:1], BACK, loops=0)
    assert [due.at_us for due in islice(endless, 3)] == [0, 1_000, 2_000]


def test_an_endless_replay_of_nothing_ends() -> None:
    assert list(ReplayPlan([], BACK, loops=0)) == []
    assert list(ReplayPlan(LOG, {"can7": "can0"}.get, loops=0)) == []


def test_error_frames_and_other_buses_are_left_out_and_counted() -> None:
    log = [Record(0, "can0", SYNC), Record(1, "can0", NO_ACK), Record(2, "can1", SYNC)]
    plan = ReplayPlan(log, BACK)
    assert (len(list(plan)), plan.left_out) == (1, 2)


@given(st.lists(st.integers(0, 10**9), max_size=30), st.floats(0.01, 100))
def test_time_never_goes_back(times_us: list[int], speed: float) -> None:
    plan = ReplayPlan([Record(at_us, "can0", SYNC) for at_us in times_us], BACK, speed)
    due = [one.at_us for one in plan]
    assert due == sorted(due)
    assert len(due) == len(times_us)


def test_a_replay_of_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="from 5 us to 5 us there is nothing"):
        ReplayPlan(LOG, BACK, from_us=5, to_us=5)
    with pytest.raises(ValueError, match="speed -1; 0 is as fast as can be"):
        ReplayPlan(LOG, BACK, -1)


@given(st.lists(st.integers(0, 200_000) | st.integers(0, 10**11), min_size=1, max_size=200))
def test_percentiles_are_exact_up_to_100_ms_and_to_a_hundredth_above(
    latenesses: list[int],
) -> None:
    counted = Lateness()
    for late_us in latenesses:
        counted.add(late_us)
    ordered = sorted(latenesses)
    for percent in (50, 99):
        exact = ordered[-(-len(ordered) * percent // 100) - 1]
        assert abs(counted.percentile_us(percent) - exact) <= (exact > 100_000) * exact / 100
    assert (counted.max_us, counted.last_us) == (ordered[-1], latenesses[-1])


def test_what_is_early_counts_as_on_time() -> None:
    counted = Lateness()
    assert str(counted) == "late p50 0 us, p99 0 us, max 0 us; last 0 us"
    counted.add(-5)
    assert (counted.count, counted.max_us) == (1, 0)
