"""Common parts of all panels, which are the frame, the keys at the foot, and lines of text.

The live tables of all panels are lines of text that are painted one by one.

A table of Textual takes eight times as long to paint.

>>> line_text((("185", "bold"), (" 37", "")))
'185 37'

The keys are at the bottom of a screen, on as many lines as they need.

>>> keys = [Key("f1", "F1", "help"), Key("q", "q", "quit"), Key("space", "space", "pause")]
>>> [[key.text for key in row] for row in key_rows(keys, 16)]
[['F1 help', 'q quit'], ['space pause']]
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from typing import Any, ClassVar, Final, NamedTuple

from rich.cells import cell_len
from rich.segment import Segment
from rich.style import Style
from textual.app import App
from textual.binding import Binding, BindingType
from textual.color import Color
from textual.driver import Driver
from textual.events import MouseDown
from textual.filter import LineFilter
from textual.geometry import Region, Size
from textual.message import Message
from textual.screen import Screen
from textual.scroll_view import ScrollView
from textual.strip import Strip
from textual.widget import Widget

from tickrig.host.cli.control import stopped_by_signals
from tickrig.host.cli.start import give_up_terminals
from tickrig.host.links.terminal import TerminalOutput
from tickrig.host.text.page_text import in_cells

Line = tuple[tuple[str, str], ...]
"""Pieces of text, each with a style such as `bold red`, or an empty style."""


def plain(text: str, style: str = "") -> Line:
    """Return a line of one piece."""
    return ((text, style),)


def line_text(line: Line) -> str:
    """Return a line without its styles."""
    return "".join(text for text, _ in line)


def line_width(line: Line) -> int:
    """Return the number of cells of a text. A wide character takes two cells."""
    return sum(cell_len(text) for text, _ in line)


__all__ = ["Line", "LineView", "line_text", "plain"]

_KEPT_STRIPS: Final = 1_000
"""Number of cached lines, which are a few screens of lines, ready to be painted again."""

_HEIGHT_BITS: Final = 6
"""Bits of the height that are kept, so that the scroll bar is at most one part in 32 too long."""


class LineView(ScrollView, can_focus=True):
    """Scrollable Textual view of many lines of text, which repaints only changed lines.

    The view needs only the lines around the visible ones, and its owner provides others when the
    user scrolls.

    Attributes:
        lines: lines that the view has at the moment.
        begin: number of the first of these lines, counted from 0.
        follows: whether the view scrolls to each new last line, because the user has not scrolled
            up.
    """

    DEFAULT_CSS = "LineView { scrollbar-size-horizontal: 0; }"

    class Moved(Message):
        """A message: the user scrolled to lines that the view does not have."""

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
        """The number of the first visible line."""
        return int(self.scroll_offset.y)

    @property
    def rows(self) -> int:
        """The number of visible lines."""
        return int(self.scrollable_content_region.height)

    @property
    def at_end(self) -> bool:
        """Whether the last line is visible."""
        return self.top >= self.max_scroll_y

    @property
    def max_scroll_y(self) -> int:
        """The number of the first visible line when the last line is visible."""
        return max(0, self._total - self.rows)

    def show(self, lines: Sequence[Line], begin: int = 0, total: int | None = None) -> None:
        """Show these lines in the view.

        Args:
            lines: lines that the view gets, which may be a part of all lines.
            begin: number of the first of these lines, counted from 0.
            total: total number of lines. By default, it is the number of `lines`.
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
        """Post a message if lines became visible that the view does not have."""
        super().watch_scroll_y(old_value, new_value)
        if self._shown_rows == self.rows:  # else it was the window that got another size
            self.follows = self.at_end
        shown = min(self.rows, self._total - self.top)
        if self.top < self.begin or self.top + shown > self.begin + len(self.lines):
            self.post_message(self.Moved())

    def scroll_to(self, x: float | None = None, y: float | None = None, **how: Any) -> None:
        """Scroll without animation. The next update of the screen would undo an animation."""
        if y is not None and not how.get("force"):  # the user scrolls; the screen may be moving
            self.follows = y >= self.max_scroll_y
        super().scroll_to(x, y, **{**how, "animate": False})

    def show_end(self) -> None:
        """Scroll to the last line at once."""
        self.scroll_to(y=self.max_scroll_y, animate=False, immediate=True, force=True)

    def render_lines(self, crop: Region) -> list[Strip]:
        """Return the content of lines of the screen."""
        base, left, width = self.rich_style, int(self.scroll_offset.x), self.size.width
        if self._ground != (base, left, width):
            self._ground = base, left, width
            self._strips.clear()
        return super().render_lines(crop)

    def render_line(self, y: int) -> Strip:
        """Return the content of a line of the screen."""
        line = self.line_at(self.top + y)
        strip = self._strips.get(line)
        if strip is None:
            if len(self._strips) > _KEPT_STRIPS:
                self._strips.clear()
            strip = self._strips[line] = line_strip(line, *self._ground)
        return strip

    def line_at(self, number: int) -> Line:
        """Return a line by its number. The result is empty if the view does not have this line."""
        return _at(self.lines, number - self.begin)


def rounded_up(total: int) -> int:
    """Round the height of a view up, so that the height seldom changes while lines arrive.

    Each change needs a new layout, and a layout takes long. The step of the rounding is a power of
    two that grows with the height.

    >>> rounded_up(50), rounded_up(1_001), rounded_up(100_000)
    (50, 1008, 100352)
    """
    step = 1 << max(0, total.bit_length() - _HEIGHT_BITS)
    return -(-total // step) * step


def line_strip(line: Line, base: Style, left: int, width: int) -> Strip:
    """Return the visible part of a line as a Textual strip, from a column on, padded to a width."""
    if line_width(line) != len(line_text(line)):
        whole = Strip([Segment(in_cells(text), _style_on(base, style)) for text, style in line])
        return whole.crop(left, left + width).adjust_cell_length(width, base)
    segments, column = [], -left
    for text, style in line:
        begin, column = column, column + len(text)
        if column > 0 and begin < width:
            text = text[max(0, -begin) : width - begin]  # noqa: PLW2901 - what is in view
            segments.append(Segment(in_cells(text), _style_on(base, style)))
    missing = width - max(0, column)
    if missing > 0:
        segments.append(Segment(" " * missing, base))
    return Strip(segments, width)


@lru_cache
def _style_on(base: Style, style: str) -> Style:
    """Return a style on the background of a widget."""
    return base + Style.parse(style)


def _at(lines: Sequence[Line], place: int) -> Line:
    return lines[place] if 0 <= place < len(lines) else ()


class Key(NamedTuple):
    """One key of the keyboard that the footer shows, with its action.

    Attributes:
        name: name of the key in Textual.
        shown: name of the key in the footer.
        description: description of the action.
    """

    name: str
    shown: str
    description: str

    @property
    def text(self) -> str:
        """Text of the key in the footer."""
        return f"{self.shown} {self.description}"


def key_rows(keys: Iterable[Key], width: int) -> list[list[Key]]:
    """Distribute the keys of a footer over as many lines as needed, without cutting any.

    Keys are separated by a blank. The lines have the given width.
    """
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
    """Return the key at a column of a footer line, or None if there is none at this column."""
    for key in row:
        if 0 <= column < len(key.text):
            return key
        column -= len(key.text) + 1
    return None


class KeyFooter(Widget):
    """Footer that shows all keys of an app in several lines. A click on a key acts like the key.

    Hidden keys are not shown. The footer of Textual has one line, and cuts keys that do not fit.
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
        """Update the footer when other keys are bound."""
        self.screen.bindings_updated_signal.subscribe(self, self._bound)

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """Return the number of lines that the footer needs."""
        return len(key_rows(self.keys, width))

    def render_line(self, y: int) -> Strip:
        """Return a line for the screen."""
        plain, bold = self.rich_style, self.get_component_rich_style("keyfooter--key")
        segments = []
        for key in self._row(y):
            segments += [Segment(key.shown, bold), Segment(f" {key.description} ", plain)]
        return Strip(segments).adjust_cell_length(self.size.width, plain)

    def on_mouse_down(self, event: MouseDown) -> None:
        """Press the key under the mouse."""
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
        """Yield a key for each action of each owner, and then the keys of the commands by name."""
        active, seen = self.screen.active_bindings, set()
        for owner, binding, _, _ in active.values():
            if binding.show and (owner, binding.action) not in seen:
                seen.add((owner, binding.action))
                shown = self.app.get_key_display(binding)
                yield Key(binding.key, shown, binding.description)
        if self.app.ENABLE_COMMAND_PALETTE and self.app.COMMAND_PALETTE_BINDING in active:
            binding = active[self.app.COMMAND_PALETTE_BINDING].binding
            yield Key(binding.key, self.app.get_key_display(binding), "commands")


# The common part of full-screen programs: their end, and the help on their keys.
#
# No program waits for its terminal. Textual queues thirty texts and then blocks its event loop,
# with all that listens for keys and signals; here a thread writes (`TerminalOutput`), and what is
# too much for a stuck terminal is dropped and painted again later.

_POSIX_DRIVER: Final = "LinuxDriver"
"""Textual's driver of POSIX terminals."""


class _Harmless(LineFilter):
    """A filter that replaces control codes in text for the terminal.

    The codes that Textual itself sends do not pass this filter.
    """

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        """Replace characters that are not printable. The number of characters stays the same."""
        return [
            piece
            if piece.control or piece.text.isprintable()
            else Segment(in_cells(piece.text), piece.style)
            for piece in segments
        ]


_HARMLESS: Final = _Harmless()


class FramedApp(App[None]):
    """Base class of the full-screen panels: a Textual app with a frame, a footer of keys, and help.

    F1 shows and hides the help, and Escape hides it. The keys q, Ctrl-Q and Ctrl-C end the app, and
    so do signals and a lost terminal. Ctrl-Q and Ctrl-C also work while a question is on the
    screen.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("f1,question_mark", "help", "help", key_display="F1"),
        Binding("escape", "leave_help", "leave help", show=False, priority=True),
        Binding("q", "quit", "quit"),
        Binding("ctrl+q,ctrl+c", "quit", "quit", show=False, priority=True),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._events: asyncio.AbstractEventLoop | None = None
        self._ended = False

    @contextmanager
    def ended_by_signals(self) -> Iterator[None]:
        """Context manager in which a signal such as SIGTERM ends the app, but not the process."""
        with stopped_by_signals(self.end):
            yield

    def end(self) -> None:
        """End the app. Signal handlers and other threads may call this, also before its start."""
        self._ended = True
        if self._events is not None and not self._events.is_closed():
            self._events.call_soon_threadsafe(self.exit)

    def on_mount(self) -> None:
        """Allow `end` to reach the event loop."""
        self._events = asyncio.get_running_loop()
        if self._ended:
            self.exit()

    def get_driver_class(self) -> type[Driver]:
        """Return the driver of Textual. On POSIX, its output does not block."""
        driver = super().get_driver_class()
        if driver.__name__ != _POSIX_DRIVER:
            return driver
        return type("FramedDriver", (_FramedDriver, driver), {})

    def get_line_filters(self) -> Sequence[LineFilter]:
        """Return the filters that are applied to all painted text."""
        return [*super().get_line_filters(), _HARMLESS]

    def notify(self, message: str, **how: Any) -> None:
        """Show a message. Brackets in texts from files and devices are not markup."""
        super().notify(message, **{**how, "markup": False})

    @property
    def helps(self) -> bool:
        """Whether help is on the screen."""
        return bool(self.screen_stack and self.screen.query("HelpPanel"))

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Pass Escape to other bindings if no help is shown."""
        return self.helps if action == "leave_help" else super().check_action(action, parameters)

    def action_help(self) -> None:
        """Show or hide the help on the keys."""
        if self.helps:
            self.action_leave_help()
        else:
            self.action_show_help_panel()

    def action_leave_help(self) -> None:
        """Hide the help on the keys."""
        self.action_hide_help_panel()

    def paint_anew(self) -> None:
        """Paint the whole screen again, for a terminal that has lost output."""
        self.refresh(layout=True)


class _FramedDriver(Driver):
    """Mix-in for the driver of Textual, for a terminal that accepts no data or disappears."""

    _output: TerminalOutput | None = None
    _leaving = False

    def __init__(self, app: FramedApp, **options: Any) -> None:
        super().__init__(app, **options)
        self._framed = app

    def start_application_mode(self) -> None:
        """Switch the terminal to the application."""
        app = self._framed
        self._output = TerminalOutput(
            sys.__stderr__.fileno() if sys.__stderr__ else 2,
            lambda: app.call_later(app.paint_anew),
            app.end,
        )
        self._leaving = False
        super().start_application_mode()  # type: ignore[safe-super] # of Textual's driver

    def write(self, data: str) -> None:
        """Write a text, or drop it if the terminal is stuck."""
        if self._output is not None:
            self._output.write(data, last=self._leaving)

    def stop_application_mode(self) -> None:
        """Restore the terminal."""
        self._leaving = True
        super().stop_application_mode()  # type: ignore[safe-super] # of Textual's driver

    def close(self) -> None:
        """End the output. Drop the remaining output if the terminal does not accept it."""
        super().close()
        if self._output is not None and not self._output.close():
            give_up_terminals()
        self._output = None

    def run_input_thread(self) -> None:
        """Read keys until the terminal is gone."""
        try:
            super().run_input_thread()  # type: ignore[misc] # of Textual's driver
        except OSError:
            self._framed.end()
