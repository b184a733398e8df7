from __future__ import annotations

import pytest
from rich.style import Style

from tickrig.host.tui.line_view import line_strip, rounded_up

LINE = (("185 ", "bold"), ("37 02", ""))


@pytest.mark.parametrize(
    ("left", "width", "text"),
    [(0, 12, "185 37 02   "), (0, 6, "185 37"), (2, 4, "5 37"), (4, 8, "37 02   "), (20, 3, "   ")],
)
def test_a_line_is_cut_and_filled_to_its_window(left: int, width: int, text: str) -> None:
    strip = line_strip(LINE, Style(), left, width)
    assert (strip.text, strip.cell_length) == (text, width)


def test_pieces_keep_their_style_on_the_ground_of_the_widget() -> None:
    ground = Style.parse("white on blue")
    first, second = list(line_strip(LINE, ground, 0, 9))
    assert first.style == ground + Style(bold=True)
    assert second.style == ground


def test_a_height_is_never_too_low_and_at_most_one_part_in_32_too_high() -> None:
    for total in range(5_000):
        assert total <= rounded_up(total) <= total + total / 32
