from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canmon.model.transmit import FrameFields, TransmitRow, parse_counter
from tickrig.wire.can import CanFrame
from tickrig.wire.instant import NEVER

FRAME = CanFrame.parse("123#0000")


def cyclic_row(period_us: int, *counters: str, count: int = 0) -> TransmitRow:
    fields = FrameFields(tuple(map(parse_counter, counters)))
    return TransmitRow("", FRAME, period_us, fields, 0, count)


def test_a_frame_is_sent_each_period() -> None:
    cyclic = cyclic_row(10_000, "1:5..6")
    sent = [frame for now_us in range(0, 35_000, 500) for frame in cyclic.tick(now_us)]
    assert [str(frame) for frame in sent] == ["123#0005", "123#0006", "123#0005", "123#0006"]
    assert cyclic.due_us == 40_000


def test_a_count_ends_it() -> None:
    cyclic = cyclic_row(10, count=2)
    assert sum(len(cyclic.tick(now_us)) for now_us in range(100)) == 2
    assert (cyclic.due_us, cyclic.tick(1 << 50)) == (NEVER, ())


@given(st.lists(st.integers(0, 50_000), min_size=1, max_size=50))
def test_it_never_drifts_however_late_it_is_called(steps_us: list[int]) -> None:
    cyclic, now_us = cyclic_row(10_000), 0
    for step_us in steps_us:
        now_us += step_us
        cyclic.tick(now_us)
        assert cyclic.due_us % 10_000 == 0
        assert 0 < cyclic.due_us - now_us <= 10_000
    assert (cyclic.sent + cyclic.missed) * 10_000 == cyclic.due_us


def test_a_period_must_be_longer_than_nothing() -> None:
    with pytest.raises(ValueError, match="has no period"):
        TransmitRow("", FRAME).enable(0)
    with pytest.raises(ValueError, match="no byte 2"):
        cyclic_row(1, "2:0..1")
