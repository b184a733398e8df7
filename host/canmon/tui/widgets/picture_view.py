"""Lines that are a picture: it is pointed at, never scrolled."""

from __future__ import annotations

from textual.events import Click
from textual.message import Message

from tickrig.host.tui.line_view import LineView


class PictureView(LineView, inherit_bindings=False):
    """Shows a picture; its keys are those of the panel."""

    class Pointed(Message):
        """Somebody has clicked on it.

        Attributes:
            x: in which column of characters.
        """

        def __init__(self, x: int) -> None:
            super().__init__()
            self.x = x

    def on_click(self, event: Click) -> None:
        """Tell where."""
        self.post_message(self.Pointed(event.x))
