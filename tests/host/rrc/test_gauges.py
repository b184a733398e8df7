from __future__ import annotations

import pytest

from tickrig.host.rrc import gauges


def test_a_bar_begins_at_zero() -> None:
    assert gauges.bar(0).plain == "░" * 15 + "│" + "░" * 15 + "    0 %"
    assert gauges.bar(100).plain == "░" * 15 + "│" + "█" * 15 + " +100 %"
    assert gauges.bar(-40).plain == "░" * 9 + "█" * 6 + "│" + "░" * 15 + "  -40 %"


@pytest.mark.parametrize(
    ("v_pct", "w_pct", "row", "column"),
    [(0, 0, 5, 10), (100, 100, 0, 20), (-100, -100, 10, 0), (100, -100, 0, 0), (50, 0, 3, 10)],
)
def test_the_stick_is_where_it_is(v_pct: int, w_pct: int, row: int, column: int) -> None:
    rows = gauges.stick_pad(v_pct, w_pct).plain.split("\n")
    assert [(y, line.index("●")) for y, line in enumerate(rows) if "●" in line] == [(row, column)]
