from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.column_log import blocks
from tests.host.canmon.model.record_log import hear, snapshot
from tests.host.canmon.model.strategies import traffic
from tickrig.host.canmon.model.columns.column_traffic import ColumnTraffic, column_buckets
from tickrig.host.canmon.model.columns.columns import records as rows_of
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.traffic import TrafficSnapshot, bucket_of
from tickrig.wire.can import CanFrame

SIZES = (1, 7, 100)


def counted(records: list[Record], size: int) -> TrafficSnapshot:
    traffic = ColumnTraffic()
    for block in blocks(records, size):
        traffic.take(block)
    return traffic.snapshot()


@pytest.mark.parametrize("size", SIZES)
@given(records=traffic())
def test_a_log_in_blocks_gives_the_same_as_frame_by_frame(size: int, records: list[Record]) -> None:
    assert counted(records, size) == snapshot(records)


def test_bits_that_change_more_often_than_a_byte_counts_are_counted() -> None:
    times = range(0, 1_000_000, 1_000)
    records = [
        Record(at_us, "can0", CanFrame(0x181, bytes([at_us // 1_000 & 1]))) for at_us in times
    ]
    assert counted(records, 600) == snapshot(records)
    assert counted(records, 600).rows[0].changed.counts()[0] == 999


@given(traffic())
def test_a_row_of_columns_is_the_frame_that_it_was(records: list[Record]) -> None:
    assert [row for block in blocks(records, 10) for row in rows_of(block)] == records


def test_a_log_of_error_frames_alone_has_no_rows() -> None:
    found = counted(hear("0 20000020#0000000000000000"), 1)
    assert found.rows == ()
    assert found.buses[0].errors.frames == 1


def test_numbers_come_as_those_of_python() -> None:
    (row,) = counted(hear("0 181#00\n0.1 181#01"), 2).rows
    assert row.gaps is not None
    assert {type(value) for value in (row.ident, row.last_us, row.bits, *row.gaps)} == {int}


@given(st.lists(st.integers(0, 1 << 62), min_size=1))
def test_a_time_has_the_same_bucket_both_ways(times_us: list[int]) -> None:
    found = column_buckets(np.array(times_us, np.int64))
    assert found.tolist() == [bucket_of(time_us) for time_us in times_us]
