"""The keys at the bottom of a screen, on as many lines as they need.

>>> keys = [Key("f1", "F1", "help"), Key("q", "q", "quit"), Key("space", "space", "pause")]
>>> [[key.text for key in row] for row in key_rows(keys, 16)]
[['F1 help', 'q quit'], ['space pause']]
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from rich.segment import Segment
from textual.events import MouseDown
from textual.geometry import Size
from textual.screen import Screen
from textual.strip import Strip
from textual.widget import Widget


class Key(NamedTuple):
    """A key.

    Attributes:
        name: as Textual calls it.
        shown: as people do.
        description: what it does.
    """

    name: str
    shown: str
    description: str

    @property
    def text(self) -> str:
        """What stands on the line."""
        return f"{self.shown} {self.description}"


def key_rows(keys: Iterable[Key], width: int) -> list[list[Key]]:
    """Return the keys on lines of so many columns, a blank between two; none is cut or left out."""
    rows: list[list[Key]] = [[]]
    left = width
    for key in keys:
        if rows[-1] and len(key.text) > left:
            rows.append([])
            left = width
        rows[-1].append(key)
        left -= len(key.text) + 1
    return rows


def key_at(row: Iterable[Key], column: int) -> Key | None:
    """Return the key that stands in a column of a line; None between two and behind them."""
    for key in row:
        if 0 <= column < len(key.text):
            return key
        column -= len(key.text) + 1
    return None


class KeyFooter(Widget):
    """Shows each key that is bound here and not hidden; a click presses it.

    Textual's own has one line, and cuts what does not fit.
    """

    COMPONENT_CLASSES = {"keyfooter--key"}  # noqa: RUF012 - Textual's name, never changed
    DEFAULT_CSS = """
    KeyFooter {
        dock: bottom; height: auto;
        background: $footer-background; color: $footer-description-foreground;
    }
    KeyFooter .keyfooter--key { color: $footer-key-foreground; text-style: bold; }
    """

    def __init__(self) -> None:
        super().__init__(id="keys")
        self.keys: list[Key] = []

    def on_mount(self) -> None:
        """Show others when others are bound."""
        self.screen.bindings_updated_signal.subscribe(self, self._bound)

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """Return how many lines it takes."""
        return len(key_rows(self.keys, width))

    def render_line(self, y: int) -> Strip:
        """Return a line for the screen."""
        plain, bold = self.rich_style, self.get_component_rich_style("keyfooter--key")
        segments = []
        for key in self._row(y):
            segments += [Segment(key.shown, bold), Segment(f" {key.description} ", plain)]
        return Strip(segments).adjust_cell_length(self.size.width, plain)

    def on_mouse_down(self, event: MouseDown) -> None:
        """Press a key."""
        if (key := key_at(self._row(event.y), event.x)) is not None:
            self.app.simulate_key(key.name)

    def _row(self, y: int) -> list[Key]:
        rows = key_rows(self.keys, self.size.width)
        return rows[y] if y < len(rows) else []

    def _bound(self, screen: Screen[object]) -> None:
        if self.is_attached and screen is self.screen:
            self.keys = list(self._bound_here())
            self.call_later(self.refresh, layout=True)  # at once is forgotten at the start

    def _bound_here(self) -> Iterator[Key]:
        """Give a key for each action of each owner, then that of the commands by name."""
        active, seen = self.screen.active_bindings, set()
        for owner, binding, _, _ in active.values():
            if binding.show and (owner, binding.action) not in seen:
                seen.add((owner, binding.action))
                shown = self.app.get_key_display(binding)
                yield Key(binding.key, shown, binding.description)
        if self.app.ENABLE_COMMAND_PALETTE and self.app.COMMAND_PALETTE_BINDING in active:
            binding = active[self.app.COMMAND_PALETTE_BINDING].binding
            yield Key(binding.key, self.app.get_key_display(binding), "commands")
