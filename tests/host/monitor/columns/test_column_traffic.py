from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tests.host.monitor.column_log import columns
from tests.host.monitor.record_log import hear, snapshot
from tests.host.monitor.strategies import traffic
from tickrig.host.monitor.columns.column_traffic import column_buckets, snapshot_of
from tickrig.host.monitor.columns.columns import records as rows_of
from tickrig.host.monitor.frames.record import Record
from tickrig.host.monitor.traffic.gaps import bucket_of


@given(traffic())
def test_a_log_at_once_gives_the_same_as_frame_by_frame(records: list[Record]) -> None:
    assert snapshot_of(columns(records)) == snapshot(records)


@given(traffic())
def test_a_row_of_columns_is_the_frame_that_it_was(records: list[Record]) -> None:
    log = columns(records)
    assert rows_of(log, np.arange(len(records))) == records


def test_a_log_of_error_frames_alone_has_no_rows() -> None:
    found = snapshot_of(columns(hear("0 20000020#0000000000000000")))
    assert found.rows == ()
    assert found.buses[0].errors.frames == 1


def test_numbers_come_as_those_of_python() -> None:
    (row,) = snapshot_of(columns(hear("0 181#00\n0.1 181#01"))).rows
    assert row.gaps is not None
    assert {type(value) for value in (row.ident, row.last_us, row.bits, *row.gaps)} == {int}


@given(st.lists(st.integers(0, 1 << 62), min_size=1))
def test_a_time_has_the_same_bucket_both_ways(times_us: list[int]) -> None:
    found = column_buckets(np.array(times_us, np.int64))
    assert found.tolist() == [bucket_of(time_us) for time_us in times_us]
