"""The picture of a system on a screen, in which a cursor moves from port to port."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from textual.binding import Binding, BindingType
from textual.events import Click, Resize
from textual.message import Message

from tickrig.host.rtc.editor.picture import Picture, draw, neighbour
from tickrig.host.rtc.editor.styles import LIT
from tickrig.host.rtc.editor.widgets import FramedView
from tickrig.host.rtc.system.dot import Box, Edge


class SystemPicture(FramedView):
    """Widget of the terminal editor that draws components as boxes and connectors as lines.

    Attributes:
        at: full name of the box or port under the cursor, empty if there are no boxes.
        marked: full name of the port that the user marked for a connection, empty if there is none.
        picture: drawing that is shown at present.
    """

    HELP = """
    # Picture

    Components with their ports, in ports at the left, out ports at the right, and a wire for each
    connector; a dashed wire does not pass the PC. Green is Active, cyan Inactive, red Error.

    Arrows move the cursor to what is next in that direction, `n` to the next component. A click
    moves it, too.

    To connect two ports: mark one, go to the other, connect.
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "go(0, -1)", show=False),
        Binding("down", "go(0, 1)", show=False),
        Binding("left", "go(-1, 0)", show=False),
        Binding("right", "go(1, 0)", show=False),
        Binding("n", "next(1)", "next", show=False),
        Binding("N", "next(-1)", "previous", show=False),
        Binding("home", "end(0)", show=False),
        Binding("end", "end(-1)", show=False),
    ]

    class Moved(Message):
        """Message of a `SystemPicture`: another box or port is under the cursor."""

    def __init__(self, id: str = "picture") -> None:  # noqa: A002 - Textual's name
        super().__init__(id)
        self.at = self.marked = ""
        self.picture = Picture((), {})
        self._boxes: tuple[Box, ...] = ()
        self._edges: tuple[Edge, ...] = ()
        self._painted: object = None

    @property
    def owner(self) -> str:
        """The component whose box contains the cursor, empty without a component."""
        return next((box.name for box in self._boxes if self.at in _names(box)), "")

    @property
    def port(self) -> str:
        """The full name of the port under the cursor, empty on a component."""
        return self.at if self.at in self.picture.places and self.at != self.owner else ""

    @property
    def is_out(self) -> bool:
        """Whether the port under the cursor is on the right side of its box."""
        return any(f"{box.name}.{port}" == self.at for box in self._boxes for port in box.outs)

    @property
    def _names(self) -> list[str]:
        """The components in the reading order of the picture."""
        places = self.picture.places
        return sorted((box.name for box in self._boxes), key=lambda name: places[name][:2])

    def joined(self, port: str) -> list[str]:
        """Return the ports that wires connect with a port."""
        ends = [(edge.source, edge.target) for edge in self._edges]
        return [b if a == port else a for a, b in ends if port in (a, b)]

    def offer(self, boxes: Sequence[Box], edges: Sequence[Edge]) -> None:
        """Show a system. The cursor stays on the same item."""
        self._boxes, self._edges = tuple(boxes), tuple(edges)
        names = {one for box in boxes for one in _names(box)}
        if self.marked not in names:
            self.marked = ""
        self.paint()

    def paint(self) -> None:
        """Show the picture and the cursor, if something changed."""
        columns = max(20, int(self.scrollable_content_region.width))
        wanted = self._boxes, self._edges, columns, self.at, self.marked, self.has_focus
        if wanted == self._painted:
            return
        self._painted = wanted
        self.picture = self._draw(columns)
        if self.at not in self.picture.places:
            self.at = next(iter(self._names), "")
            self.picture = self._draw(columns)
        self.show(self.picture.lines)

    def _draw(self, columns: int) -> Picture:
        lit = {self.marked: LIT} if self.marked else {}
        if self.at:
            lit[self.at] = "reverse" if self.has_focus else "underline"
        return draw(self._boxes, self._edges, columns, lit)

    def go_to(self, name: str) -> None:
        """Put the cursor on a box or port, and scroll it into view."""
        if name not in self.picture.places:
            return
        self.at = name
        place, width = self.picture.places[name], int(self.scrollable_content_region.width)
        top, left = self.top, int(self.scroll_offset.x)
        if not top < place.line < top + self.rows - 1:
            self.scroll_to(y=max(0, place.line - self.rows // 2), immediate=True)
        if place.column < left or place.column + place.width > left + width:
            self.scroll_to(x=max(0, place.column - width // 2), immediate=True)
        self.paint()
        self.post_message(self.Moved())

    def action_go(self, right: int, down: int) -> None:
        """Move the cursor to the next item in a direction."""
        if self.at in self.picture.places:
            self.go_to(neighbour(self.picture.places, self.at, right, down))

    def action_next(self, by: int) -> None:
        """Move the cursor to the next component."""
        if names := self._names:
            here = names.index(self.owner) if self.owner in names else 0
            self.go_to(names[(here + by) % len(names)])

    def action_end(self, place: int) -> None:
        """Move the cursor to the first or last component."""
        if names := self._names:
            self.go_to(names[place])

    def on_click(self, event: Click) -> None:
        """Put the cursor at the position of the mouse."""
        at = event.get_content_offset(self)
        if at is None:
            return
        line, cell = self.top + at.y, int(self.scroll_offset.x) + at.x
        for name, place in self.picture.places.items():
            if place.line == line and place.column - 1 <= cell <= place.column + place.width:
                self.go_to(name)

    def on_resize(self, event: Resize) -> None:
        """Draw the picture for the new width."""
        self.paint()


def _names(box: Box) -> tuple[str, ...]:
    ports = (*box.ins, *box.outs)
    return (box.name, *(f"{box.name}.{port}" for port in ports))
