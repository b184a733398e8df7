"""What all full-screen programs do alike: how they end, and how they explain their keys."""

from __future__ import annotations

import asyncio
import signal
import sys
from collections.abc import Sequence
from typing import Any, ClassVar, Final

from rich.segment import Segment
from textual.app import App
from textual.binding import Binding, BindingType
from textual.color import Color
from textual.filter import LineFilter

from tickrig.host.cli.start import TERMINATING
from tickrig.host.text.page_text import in_cells


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

    Ctrl-Q and Ctrl-C do so from anywhere, also while a question is on the screen.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("f1,question_mark", "help", "help", key_display="F1"),
        Binding("escape", "leave_help", "leave help", show=False, priority=True),
        Binding("q", "quit", "quit"),
        Binding("ctrl+q,ctrl+c", "quit", "quit", show=False, priority=True),
    ]

    def on_mount(self) -> None:
        """Let signals end it; an event loop of Windows takes none."""
        if sys.platform != "win32":
            loop = asyncio.get_running_loop()
            for number in (signal.SIGINT, *TERMINATING):
                loop.add_signal_handler(number, self.exit)

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
