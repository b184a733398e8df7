"""Lines of text that are painted one by one: the live tables of all panels.

A table of Textual takes eight times as long to paint.

>>> line_text((("185", "bold"), (" 37", "")))
'185 37'
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Final

from rich.segment import Segment
from rich.style import Style
from textual.geometry import Region, Size
from textual.message import Message
from textual.scroll_view import ScrollView
from textual.strip import Strip

from tickrig.host.text.page_text import in_cells

Line = tuple[tuple[str, str], ...]
"""Pieces of text, each with a style as `bold red`; empty for none."""


def plain(text: str, style: str = "") -> Line:
    """Return a line of one piece."""
    return ((text, style),)


def line_text(line: Line) -> str:
    """Return a line without its styles."""
    return "".join(text for text, _ in line)


def line_width(line: Line) -> int:
    """Return how many characters it has."""
    return sum(len(text) for text, _ in line)


__all__ = ["Line", "LineView", "line_text", "plain"]

KEPT_STRIPS: Final = 1_000
"""A few screens of lines, ready to be painted again."""

HEIGHT_BITS: Final = 6
"""The scroll bar is at most one part in 32 too long."""


class LineView(ScrollView, can_focus=True):
    """Shows lines; only those that changed are painted again.

    Not all lines need be there: of many, those around the ones in view do.

    Attributes:
        lines: those that are there.
        begin: the number of the first of them, from 0.
        follows: the last line shall stay in view: nobody has scrolled up from it.
    """

    DEFAULT_CSS = "LineView { scrollbar-size-horizontal: 0; }"

    class Moved(Message):
        """Lines are in view that are not there."""

    def __init__(self, id: str | None = None) -> None:  # noqa: A002 - Textual's name
        super().__init__(id=id)
        self.lines: list[Line] = []
        self.begin, self.follows = 0, True
        self._shown_rows = 0
        self._ground = Style(), 0, 0
        self._total = 0
        self._strips: dict[Line, Strip] = {}

    @property
    def top(self) -> int:
        """The number of the first line in view."""
        return int(self.scroll_offset.y)

    @property
    def rows(self) -> int:
        """How many lines are in view."""
        return int(self.scrollable_content_region.height)

    @property
    def at_end(self) -> bool:
        """Whether the last line is in view."""
        return self.top >= self.max_scroll_y

    @property
    def max_scroll_y(self) -> int:
        """The number of the first line in view where the last one is in view, too."""
        return max(0, self._total - self.rows)

    def show(self, lines: Sequence[Line], begin: int = 0, total: int | None = None) -> None:
        """Show lines.

        Args:
            lines: those that are there.
            begin: the number of the first of them.
            total: how many there are in all; as many as there are here if it is not given.
        """
        before, was = self.lines, self.begin
        self.lines, self.begin = list(lines), begin
        self._total = len(self.lines) if total is None else total
        width = max(map(line_width, lines), default=0)
        if self.virtual_size != (size := Size(width, rounded_up(self._total))):
            self.virtual_size = size
        self._shown_rows = self.rows
        changed = [
            number
            for number in range(self.top, self.top + self.rows)
            if _at(before, number - was) != _at(self.lines, number - begin)
        ]
        if changed:  # lines between them cost less than many regions do
            self.refresh_lines(changed[0], changed[-1] + 1 - changed[0])

    def watch_scroll_y(self, old_value: float, new_value: float) -> None:
        """Tell that lines came into view that are not there."""
        super().watch_scroll_y(old_value, new_value)
        if self._shown_rows == self.rows:  # else it was the window that got another size
            self.follows = self.at_end
        shown = min(self.rows, self._total - self.top)
        if self.top < self.begin or self.top + shown > self.begin + len(self.lines):
            self.post_message(self.Moved())

    def scroll_to(self, x: float | None = None, y: float | None = None, **how: Any) -> None:
        """Scroll at once: what is animated, the next picture would undo."""
        if y is not None and not how.get("force"):  # somebody scrolls; the screen may be moving
            self.follows = y >= self.max_scroll_y
        super().scroll_to(x, y, **{**how, "animate": False})

    def show_end(self) -> None:
        """Scroll to the last line, at once."""
        self.scroll_to(y=self.max_scroll_y, animate=False, immediate=True, force=True)

    def render_lines(self, crop: Region) -> list[Strip]:
        """Return what is painted on lines of the screen."""
        base, left, width = self.rich_style, int(self.scroll_offset.x), self.size.width
        if self._ground != (base, left, width):
            self._ground = base, left, width
            self._strips.clear()
        return super().render_lines(crop)

    def render_line(self, y: int) -> Strip:
        """Return what is painted on a line of the screen."""
        line = self.line_at(self.top + y)
        strip = self._strips.get(line)
        if strip is None:
            if len(self._strips) > KEPT_STRIPS:
                self._strips.clear()
            strip = self._strips[line] = line_strip(line, *self._ground)
        return strip

    def line_at(self, number: int) -> Line:
        """Return a line by its number; an empty one if it is not there."""
        return _at(self.lines, number - self.begin)


def rounded_up(total: int) -> int:
    """Return a height that seldom changes while lines come: to lay out a screen takes long.

    >>> rounded_up(50), rounded_up(1_001), rounded_up(100_000)
    (50, 1008, 100352)
    """
    step = 1 << max(0, total.bit_length() - HEIGHT_BITS)
    return -(-total // step) * step


def line_strip(line: Line, base: Style, left: int, width: int) -> Strip:
    """Return a line as it is painted: from a column on, filled up to a width."""
    segments, column = [], -left
    for text, style in line:
        begin, column = column, column + len(text)
        if column > 0 and begin < width:
            text = text[max(0, -begin) : width - begin]  # noqa: PLW2901 - what is in view
            segments.append(Segment(in_cells(text), style_on(base, style)))
    missing = width - max(0, column)
    if missing > 0:
        segments.append(Segment(" " * missing, base))
    return Strip(segments, width)


@lru_cache
def style_on(base: Style, style: str) -> Style:
    """Return a style on the ground of a widget."""
    return base + Style.parse(style)


def _at(lines: Sequence[Line], place: int) -> Line:
    return lines[place] if 0 <= place < len(lines) else ()
