"""What all full-screen programs do alike: how they end, and how they explain their keys.

No program waits for its terminal. Textual queues thirty texts and then blocks its event loop, with
all that listens for keys and signals; here a thread writes (`TerminalOutput`), and what is too much
for a stuck terminal is dropped and painted again later.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, ClassVar, Final

from rich.segment import Segment
from textual.app import App
from textual.binding import Binding, BindingType
from textual.color import Color
from textual.driver import Driver
from textual.filter import LineFilter

from tickrig.host.cli.serving import stopped_by_signals
from tickrig.host.cli.start import give_up_terminals
from tickrig.host.links.terminal import TerminalOutput
from tickrig.host.text.page_text import in_cells

POSIX_DRIVER: Final = "LinuxDriver"
"""Textual's driver of POSIX terminals."""


class _Harmless(LineFilter):
    """Lets no text command the terminal: the codes of Textual are not among what it sees."""

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        """Return pieces of as many characters, all of which are seen."""
        return [
            piece
            if piece.control or piece.text.isprintable()
            else Segment(in_cells(piece.text), piece.style)
            for piece in segments
        ]


HARMLESS: Final = _Harmless()


class FramedApp(App[None]):
    """F1 shows and hides help, Escape hides it; q, Ctrl-Q, Ctrl-C and signals end it.

    Ctrl-Q and Ctrl-C do so from anywhere, also while a question is on the screen. A terminal that
    is gone ends it too.
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
        """Let signals end the app only, so that what follows it in the block is done too."""
        with stopped_by_signals(self.end):
            yield

    def end(self) -> None:
        """End the app, from a signal handler or another thread, also before it has begun."""
        self._ended = True
        if self._events is not None and not self._events.is_closed():
            self._events.call_soon_threadsafe(self.exit)

    def on_mount(self) -> None:
        """Let `end` reach the event loop."""
        self._events = asyncio.get_running_loop()
        if self._ended:
            self.exit()

    def get_driver_class(self) -> type[Driver]:
        """Return the driver of Textual, on POSIX with output that nobody waits for."""
        driver = super().get_driver_class()
        if driver.__name__ != POSIX_DRIVER:
            return driver
        return type("FramedDriver", (_FramedDriver, driver), {})

    def get_line_filters(self) -> Sequence[LineFilter]:
        """Return what all that is painted passes."""
        return [*super().get_line_filters(), HARMLESS]

    def notify(self, message: str, **how: Any) -> None:
        """Show a message; brackets in what files and devices say are no markup."""
        super().notify(message, **{**how, "markup": False})

    @property
    def helps(self) -> bool:
        """Whether help is on the screen."""
        return bool(self.screen_stack and self.screen.query("HelpPanel"))

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Leave Escape to others where there is no help."""
        return self.helps if action == "leave_help" else super().check_action(action, parameters)

    def action_help(self) -> None:
        """Show or hide what the keys do here."""
        if self.helps:
            self.action_leave_help()
        else:
            self.action_show_help_panel()

    def action_leave_help(self) -> None:
        """Hide what the keys do."""
        self.action_hide_help_panel()

    def paint_anew(self) -> None:
        """Paint all of the screen, as a terminal wants that has missed something."""
        self.refresh(layout=True)


class _FramedDriver(Driver):
    """The driver of a terminal that may take nothing, or go; mixed into that of Textual."""

    _output: TerminalOutput | None = None
    _leaving = False

    def __init__(self, app: FramedApp, **options: Any) -> None:
        super().__init__(app, **options)
        self._framed = app

    def start_application_mode(self) -> None:
        """Take the terminal."""
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
        """Give the terminal back."""
        self._leaving = True
        super().stop_application_mode()  # type: ignore[safe-super] # of Textual's driver

    def close(self) -> None:
        """End the output; a terminal that does not take it is given up."""
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
