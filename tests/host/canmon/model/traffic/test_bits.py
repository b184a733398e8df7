from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canmon.model.traffic import BitMemory

PAYLOADS = st.lists(st.integers(0, (1 << 64) - 1), min_size=1)


@given(PAYLOADS)
def test_each_bit_is_counted_when_it_changes(payloads: list[int]) -> None:
    memory = BitMemory(payloads[0])
    for payload in payloads[1:]:
        memory.take(payload)
    changes = [one ^ two for one, two in pairwise(payloads)]
    expected = tuple(sum(change >> bit & 1 for change in changes) for bit in range(64))
    assert memory.row().counts() == expected


def test_the_latest_change_is_shown_until_the_next_frame() -> None:
    memory = BitMemory(0b00)
    memory.take(0b11)
    assert memory.row().latest == 0b11
    memory.same()
    assert memory.row().latest == 0
    assert memory.row().changed == 0b11


def test_a_notch_hides_what_changed_before_it_alone() -> None:
    memory = BitMemory(0)
    memory.take(0b01)
    memory.notch()
    assert memory.row().changed == 0
    memory.take(0b10)
    assert memory.row().changed == 0b10


def test_a_row_does_not_change_any_more() -> None:
    memory = BitMemory(0)
    memory.take(1)
    row = memory.row()
    memory.take(0)
    assert row.counts()[0] == 1
