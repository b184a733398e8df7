from __future__ import annotations

import pytest

from tickrig.host.canmon.model.transmit import FrameFields, TransmitList, TransmitRow, parse_counter
from tickrig.wire.can import CanFrame
from tickrig.wire.instant import NEVER

SYNC = CanFrame.parse("080#")


def armed(*rows: TransmitRow) -> TransmitList:
    made = TransmitList(list(rows))
    made.armed = True
    return made


def sent(rows: TransmitList, from_us: int, to_us: int) -> list[str]:
    return [str(frame) for now_us in range(from_us, to_us, 500) for frame in rows.tick(now_us)]


def test_nothing_is_sent_until_it_is_armed() -> None:
    rows = TransmitList([TransmitRow("sync", SYNC, 10_000)])
    with pytest.raises(ValueError, match="not armed: nothing is sent"):
        rows.enable(0, 0)
    with pytest.raises(ValueError, match="not armed: nothing is sent"):
        rows.once(0)
    rows.armed = True
    assert (rows.due_us, sent(rows, 0, 50_000)) == (NEVER, [])


def test_an_enabled_row_is_sent_in_each_period() -> None:
    rows = armed(TransmitRow("sync", SYNC, 10_000), TransmitRow("other", SYNC, 5_000))
    rows.enable(0, 3_000)
    assert rows.due_us == 3_000
    assert sent(rows, 0, 34_000) == ["080#"] * 4
    assert ([row.sent for row in rows.rows], rows.due_us) == ([4, 0], 43_000)


def test_a_row_that_is_enabled_twice_keeps_its_time() -> None:
    rows = armed(TransmitRow("sync", SYNC, 10_000))
    rows.enable(0, 0)
    rows.tick(0)
    rows.enable(0, 4_000)
    assert rows.due_us == 10_000


def test_stopping_disables_all_rows_also_for_the_next_time() -> None:
    rows = armed(TransmitRow("sync", SYNC, 1_000), TransmitRow("again", SYNC, 1_000))
    rows.enable(0, 0)
    rows.enable(1, 0)
    rows.stop()
    assert (rows.armed, [row.enabled for row in rows.rows]) == (False, [False, False])
    rows.armed = True
    assert sent(rows, 0, 10_000) == []


def test_a_counter_goes_on_over_once_and_cyclic() -> None:
    fields = FrameFields((parse_counter("0:0..255"),))
    rows = armed(TransmitRow("count", CanFrame.parse("100#00"), 1_000, fields))
    assert rows.once(0) == (CanFrame.parse("100#00"),)
    rows.enable(0, 0)
    assert sent(rows, 0, 2_000) == ["100#01", "100#02"]
    rows.rows[0].disable()
    assert rows.once(0) == (CanFrame.parse("100#03"),)


def test_periods_that_passed_whole_are_counted() -> None:
    rows = armed(TransmitRow("sync", SYNC, 1_000))
    rows.enable(0, 0)
    assert len(rows.tick(10_500)) == 1
    rows.tick(20_500)
    assert (rows.rows[0].sent, rows.rows[0].missed) == (2, 19)


def test_a_row_without_a_period_is_sent_once_or_not() -> None:
    rows = armed(TransmitRow("sync", SYNC))
    with pytest.raises(ValueError, match="sync has no period"):
        rows.enable(0, 0)
    assert rows.once(0) == (SYNC,)


def test_a_row_that_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="sync: a period of -1 us; 0 is none"):
        TransmitRow("sync", SYNC, -1)
    with pytest.raises(ValueError, match="no byte 0"):
        TransmitRow("sync", SYNC, 0, FrameFields((parse_counter("0:0..1"),)))
