from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.tui import Key, key_at, key_rows

KEYS = st.lists(st.builds(Key, st.text(max_size=3), st.text(max_size=5), st.text(max_size=12)))


@given(KEYS, st.integers(1, 60))
def test_no_key_is_cut_or_left_out(keys: list[Key], width: int) -> None:
    rows = key_rows(keys, width)
    assert [key for row in rows for key in row] == keys
    for row in rows:
        assert len(row) < 2 or len(" ".join(key.text for key in row)) <= width


@given(KEYS, st.integers(1, 60))
def test_each_column_of_a_key_is_its_own(keys: list[Key], width: int) -> None:
    for row in key_rows(keys, width):
        columns = [key for key in row for _ in (*key.text, " ")]
        for column, key in enumerate(columns):
            assert key_at(row, column) in (key, None)
        assert key_at(row, len(columns)) is None
