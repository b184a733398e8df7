from __future__ import annotations

import asyncio

import pytest
from rich.style import Style
from textual.app import App, ComposeResult

from tests.host.canmon.tui.pilot import screen_text
from tickrig.host.tui import LineView, line_strip, plain, rounded_up

LINE = (("185 ", "bold"), ("37 02", ""))


@pytest.mark.parametrize(
    ("left", "width", "text"),
    [(0, 12, "185 37 02   "), (0, 6, "185 37"), (2, 4, "5 37"), (4, 8, "37 02   "), (20, 3, "   ")],
)
def test_a_line_is_cut_and_filled_to_its_window(left: int, width: int, text: str) -> None:
    strip = line_strip(LINE, Style(), left, width)
    assert (strip.text, strip.cell_length) == (text, width)


@pytest.mark.parametrize(
    ("left", "width", "text"),
    [
        (0, 8, "ロボ1   "),
        (0, 4, "ロボ"),
        (2, 3, "ボ1"),
        (0, 3, "ロ "),
        (1, 4, " ボ1"),
        (9, 2, "  "),
    ],
)
def test_a_wide_character_takes_two_cells(left: int, width: int, text: str) -> None:
    strip = line_strip(plain("ロボ1"), Style(), left, width)
    assert (strip.text, strip.cell_length) == (text, width)


def test_pieces_keep_their_style_on_the_ground_of_the_widget() -> None:
    ground = Style.parse("white on blue")
    first, second = list(line_strip(LINE, ground, 0, 9))
    assert first.style == ground + Style(bold=True)
    assert second.style == ground


@pytest.mark.parametrize("top", [0, 3, 50, 92])
def test_a_line_that_changed_is_painted_wherever_the_view_is(top: int) -> None:
    class Lines(App[None]):
        def compose(self) -> ComposeResult:
            yield LineView()

    async def main() -> None:
        app = Lines()
        async with app.run_test(size=(20, 8)) as pilot:
            view = app.query_one(LineView)
            lines = [plain(f"line {number}") for number in range(100)]
            view.show(lines)
            await pilot.pause()
            view.scroll_to(y=top)
            await pilot.pause()
            for row in (0, 4, 7):
                lines[top + row] = plain(f"other {row}")
                view.show(lines)
                await pilot.pause()
                assert f"other {row}" in screen_text(app)

    asyncio.run(main())


def test_a_height_is_never_too_low_and_at_most_one_part_in_32_too_high() -> None:
    for total in range(5_000):
        assert total <= rounded_up(total) <= total + total / 32
