"""The System Editor of a running server, with nodes, their objects, and their connections."""

from __future__ import annotations

import sys
from collections.abc import Callable
from itertools import chain, repeat
from pathlib import Path
from textwrap import wrap
from typing import ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container

from tickrig.host.canmon.model.decode.decoded import write_entry
from tickrig.host.rtc.canopen.definition import ServerRefused
from tickrig.host.rtc.canopen.editor.objects_pane import ObjectsPane
from tickrig.host.rtc.canopen.editor.pdo_screen import PdoScreen
from tickrig.host.rtc.canopen.editor.session import EditorSession
from tickrig.host.rtc.canopen.editor.system_pane import (
    Item,
    SystemPane,
    boxes_and_edges,
    connect,
    joints,
    link,
    remove,
)
from tickrig.host.rtc.canopen.events import ServerEvent, ServerEventType
from tickrig.host.rtc.canopen.served_node import NodePhase
from tickrig.host.rtc.canopen.view import NodeView, PortView, ServerView, SystemView
from tickrig.host.rtc.editor.styles import ALARM, DIM, LIT
from tickrig.host.rtc.editor.system_picture import SystemPicture
from tickrig.host.rtc.editor.widgets import ChoiceScreen, CursorRow, CursorView, QuestionScreen
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.tui import FramedApp, KeyFooter, Line, LineView, plain

# The line at the bottom, and lines of events.


_STAMP: Final = 12
"""Number of columns of a time."""

_GOOD: Final = (
    ServerEventType.BOOT_UP,
    ServerEventType.PROXY_MADE,
    ServerEventType.STATE_CHANGED,
    ServerEventType.CONNECTED,
    ServerEventType.PDO_LINKED,
    ServerEventType.PDO_UNLINKED,
    ServerEventType.BUS_ON,
)
"""Events that need no attention."""


def _event_lines(event: ServerEvent, width: int) -> list[Line]:
    """Return an event as lines of at most `width` columns, wrapped between words."""
    at, _, rest = str(event).partition(" ")
    style = "" if event.kind in _GOOD else ALARM
    stamps = chain([f"{at:>{_STAMP}} "], repeat(" " * (_STAMP + 1)))
    parts = wrap(rest, max(1, width - _STAMP - 1)) or [""]
    return [((stamp, DIM), (part, style)) for stamp, part in zip(stamps, parts, strict=False)]


def _status_line(nodes: tuple[NodeView, ...], file: str, bus: str, marked: str) -> Line:
    """Return a line with the served definition, the bus, and the port to connect."""
    ready = sum(node.phase is NodePhase.READY for node in nodes)
    active = sum(node.proxy_state == "ACTIVE" for node in nodes)
    return (
        (f" {file} ", "bold"),
        (f" {bus}  {ready} of {len(nodes)} nodes ready, {active} active", ""),
        (f"  marked: {marked.partition(' ')[2]}" if marked else "", LIT),
    )


PAINT_S: Final = 0.1
_SWITCH_S: Final = 0.000_5
"""Longest time that the screen may keep the server from running."""

_EVENTS_SHOWN: Final = 500

_Command = Callable[[ServerView], object]
_Join = Callable[[ServerView, Item, Item], None]

_JOIN: Final[dict[str, _Join]] = {"connect": connect, "link": link}
_ASK: Final[dict[str, Callable[[ServerView, str], None]]] = {
    "activate": ServerView.activate,
    "deactivate": ServerView.deactivate,
    "reset": ServerView.reset,
}


class SystemEditor(FramedApp):
    """Terminal editor that shows a running CANopen server and controls it by keys and mouse.

    Args:
        session: session with the server. The caller of the app starts the session.
        bus: name of the bus, for display.
    """

    TITLE = "RTC-CANopen System Editor"
    CSS_PATH = "editor.tcss"
    HORIZONTAL_BREAKPOINTS: ClassVar[list[tuple[int, str]] | None] = [  # type: ignore[misc]
        (0, "-narrow"),
        (130, "-wide"),
    ]
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("a", "request('activate')", "activate"),
        Binding("d", "request('deactivate')", "deactivate"),
        Binding("r", "request('reset')", "reset"),
        Binding("b", "boot", "set up again", show=False),
        Binding("S", "start", "activate all in the start order", show=False),
        Binding("m", "mark", "mark"),
        Binding("c", "join('connect')", "connect"),
        Binding("k", "join('link')", "link"),
        Binding("x", "remove", "remove"),
        Binding("p", "pdos", "PDOs"),
        Binding("v", "picture", "picture"),
        Binding("g", "read", "read the object again", show=False),
        Binding("w", "write", "write"),
        Binding("l", "live", "live"),
        Binding("ctrl+s", "save", "save", key_display="^s"),
        Binding("ctrl+o", "load", "load", key_display="^o"),
    ]

    def __init__(self, session: EditorSession, bus: str = "") -> None:
        super().__init__()
        self.session, self._bus = session, bus
        self.system, self.objects = SystemPane(), ObjectsPane()
        self.picture = SystemPicture()
        self.events, self.status = LineView("events"), LineView("status")

    def compose(self) -> ComposeResult:
        """Lay out the panes."""
        with Container(id="panes"):
            yield self.system
            yield self.picture
            yield self.objects
        yield self.events
        yield self.status
        yield KeyFooter()

    def on_mount(self) -> None:
        """Start updating the screen."""
        self.status.can_focus, self.events.border_title = False, "events"
        self.picture.display = False
        self.system.focus()
        self.set_interval(PAINT_S, self.look)

    def run_session(self) -> None:
        """Run the server in a thread, and show the editor until the user leaves it.

        Raises:
            LinkClosed: the bus is gone.
        """
        before_s = sys.getswitchinterval()
        sys.setswitchinterval(_SWITCH_S)
        with self.ended_by_signals():
            self.session.start()
            try:
                self.run()
            finally:
                sys.setswitchinterval(before_s)
                self.session.close()

    def look(self) -> None:
        """Update the editor with the present state of the server.

        The app calls this method ten times a second, and after each command.
        """
        if self.session.ended:
            self.exit()
            return
        with self.session.lock:
            view = self.session.view
            system, events = view.system, view.events[-_EVENTS_SHOWN:]
        self.system.look(system)
        if self.picture.display:
            self._look_at_picture(system)
        self.objects.turn_to(self.system.node_id, self.session.eds_paths)
        with self.session.lock:
            self.objects.look(view)
        self.objects.paint_objects()
        marked = self.system.marked.key if self.system.marked else ""
        file = self.session.path.name
        self.status.show([_status_line(system.nodes, file, self._bus, marked)])
        for screen in self.screen_stack:
            if isinstance(screen, PdoScreen):
                screen.look()
        follows = self.events.at_end
        width = max(1, self.events.scrollable_content_region.width)
        self.events.show([line for event in events for line in _event_lines(event, width)])
        if follows:
            self.events.show_end()

    def _look_at_picture(self, system: SystemView) -> None:
        marked = self.system.marked.item if self.system.marked else None
        self.picture.marked = marked.name if isinstance(marked, PortView) else ""
        self.picture.offer(*boxes_and_edges(system))
        self.picture.frame("system", self.picture.at)

    def on_system_picture_moved(self) -> None:
        """Make the keys apply to the item under the cursor of the picture."""
        self.system.go_to(self.picture.at)
        self.look()

    def on_cursor_view_moved(self) -> None:
        """Show the data of the row under the cursor."""
        self.look()

    def on_cursor_view_entered(self, event: CursorView.Entered) -> None:
        """Write the chosen object, or fold or open the chosen row."""
        self.look()
        if event.view is self.objects:
            self.action_write()

    def action_request(self, what: str) -> None:
        """Request a state of the proxy or component under the cursor."""
        if (owner := self.system.owner) is not None:
            self._command(lambda view: _ASK[what](view, owner.name))

    def action_boot(self) -> None:
        """Set up the node again, even if it was refused."""
        if node_id := self.system.node_id:
            self._command(lambda view: view.boot(node_id))

    def action_start(self) -> None:
        """Activate all nodes in the start order."""
        self._command(ServerView.start)

    def action_mark(self) -> None:
        """Mark a port or PDO, or remove the mark."""
        if not self.system.mark():
            self._refuse("ports and PDOs can be marked")
        self.look()

    def action_join(self, how: str) -> None:
        """Connect the marked item with the item under the cursor."""
        marked, row = self.system.marked, self.system.row
        if marked is None or row is None:
            self._refuse("mark a port or PDO first (m)")
        elif self._command(lambda view: _JOIN[how](view, marked.item, row.item)):
            self.system.marked = None
            self.look()

    def action_remove(self) -> None:
        """End the PDO link or the connection in the row under the cursor.

        If the system is shown as a picture and the cursor is on a port, end a PDO link or a
        connection of this port. If the port has several, the user selects one.
        """
        if (row := self.system.row) is None:
            return
        if not (self.picture.display and isinstance(row.item, PortView)):
            self._command(lambda view: remove(view, row.item))
            return
        with self.session.lock:
            found = joints(self.session.view.system, row.item)
        if not found:
            self._refuse("go to a port that is connected or linked")
        elif len(found) == 1:
            self._command(lambda view: remove(view, found[0]))
        else:
            texts = [f"{one.source} → {one.target}" for one in found]
            rows = [
                CursorRow(text, plain(text), one) for text, one in zip(texts, found, strict=True)
            ]
            ChoiceScreen(f"remove from {row.item.name}", rows).prompt(
                self, lambda one: self._command(lambda view: remove(view, one))
            )

    def action_picture(self) -> None:
        """Show the system as a picture, or as a list."""
        shown = not self.picture.display
        self.picture.display, self.system.display = shown, not shown
        self.query_one("#panes").set_class(shown, "-pictured")
        if not shown:
            self.system.focus()
            return
        self.system.folded.clear()
        self.picture.focus()
        self.look()
        if isinstance(row := self.system.row and self.system.row.item, NodeView | PortView):
            self.picture.go_to(row.name)

    def action_pdos(self) -> None:
        """Show and edit the PDOs of the node whose rows contain the cursor."""
        if node_id := self.system.node_id:
            self.push_screen(PdoScreen(self.session, node_id))
        else:
            self._refuse("go to a row of a node: components have no PDOs")

    def action_read(self) -> None:
        """Read the object under the cursor again."""
        objects, row = self.objects.objects, self.objects.row
        if objects is not None and row is not None:
            objects.read(row.item)
            self.look()

    def action_live(self) -> None:
        """Read the visible objects repeatedly, or stop this."""
        if (objects := self.objects.objects) is not None:
            objects.live = not objects.live
            self.look()

    def action_write(self) -> None:
        """Ask for a value, and write it to the object."""
        objects, row = self.objects.objects, self.objects.row
        if objects is None or row is None:
            return
        name = objects.text_of(row.item).name
        question = QuestionScreen(f"{write_entry(row.item)} {name}", objects.value_of(row.item))
        question.prompt(
            self,
            lambda words: self._command(lambda view: objects.write(view, row.item, words)),
        )

    def action_save(self) -> None:
        """Ask for a file, and save the definition with the present connections and links."""
        self._prompt_path("save the System Definition as", self.session.save)

    def action_load(self) -> None:
        """Ask for a file, and serve the definition in this file."""
        self._prompt_path("load the System Definition", self._load)

    def _load(self, path: Path) -> None:
        self.session.load(path)
        self.system.forget()
        self.objects.forget()

    def _prompt_path(self, text: str, do: Callable[[Path], None]) -> None:
        def answered(path: str) -> None:
            if path and self._try(lambda: do(Path(path))):
                self.notify(f"{text}: {path}", markup=False)

        QuestionScreen(text, str(self.session.path)).prompt(self, answered)

    def _command(self, command: _Command) -> bool:
        """Send a command to the server. If the server refuses, show the reason."""

        def give() -> None:
            with self.session.lock:
                command(self.session.view)

        return self._try(give)

    def _try(self, do: Callable[[], object]) -> bool:
        """Call a function. If the server refuses, show the reason."""
        try:
            do()
        except (RtcRefused, ServerRefused, ValueError) as error:
            return self._refuse(str(error))
        except OSError as error:
            return self._refuse(f"{error.filename}: {error.strerror}")
        self.look()
        return True

    def _refuse(self, why: str) -> bool:
        self.notify(why, severity="error", markup=False)
        return False
