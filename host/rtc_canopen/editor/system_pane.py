"""The tree of nodes, components and what joins them."""

from __future__ import annotations

from typing import ClassVar

from textual.binding import Binding, BindingType

from tickrig.host.rtc_canopen.definition.definition import PdoLink, RtConnection
from tickrig.host.rtc_canopen.editor.cursor_view import CursorView
from tickrig.host.rtc_canopen.editor.system_rows import Item, SystemRow, system_rows
from tickrig.host.rtc_canopen.view import ComponentView, NodeView, PdoView, PortView, SystemView

Owner = NodeView | ComponentView


class SystemPane(CursorView[Item]):
    """Shows a system; the cursor chooses what commands are about.

    Attributes:
        folded: keys of rows that are shown without what they have.
        marked: the port or PDO that is to be connected.
        node_id: the node in whose rows the cursor was last; 0 for none.
    """

    HELP = """
    # System

    Nodes with the state of the proxy, that of NMT, and how long ago the heartbeat was; their
    PDOs and ports; other components; at the end what joins them.

    To join two: mark a port or PDO, go to another, then connect them through the PC (ports) or
    link them without it (PDOs). To end it: go to it at the end, and remove it.

    A click moves the cursor; a double click, or one at the margin, opens and folds.
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("left", "fold(True)", "fold", show=False),
        Binding("right", "fold(False)", "open", show=False),
    ]

    def __init__(self) -> None:
        super().__init__("system")
        self.forget()

    def forget(self) -> None:
        """Begin anew, with another system."""
        self.folded: set[str] = set()
        self.marked: SystemRow | None = None
        self.node_id, self.cursor = 0, 0

    @property
    def owner(self) -> Owner | None:
        """The node or component in whose rows the cursor is; None among what joins them."""
        if self.row is None or isinstance(self.row.item, PdoLink | RtConnection):
            return None
        above = (row.item for row in reversed(self.rows_shown[: self.cursor + 1]))
        return next(item for item in above if isinstance(item, Owner))

    def look(self, system: SystemView) -> None:
        """Show how things are now."""
        self.offer(system_rows(system, self.folded, self.marked.key if self.marked else ""))
        match self.owner:
            case NodeView() as node:
                self.node_id = node.node_id
            case ComponentView():
                self.node_id = 0

    def mark(self) -> bool:
        """Mark the port or PDO under the cursor, or let it go; False if it is none."""
        row = self.row
        if row is None or not isinstance(row.item, PdoView | PortView):
            return False
        self.marked = None if self.marked and self.marked.key == row.key else row
        return True

    def action_enter(self) -> None:
        """Fold or open what is under the cursor."""
        if self.row is not None:
            self.action_fold(self.row.key not in self.folded)

    def action_fold(self, folded: bool) -> None:
        """Show the node or component under the cursor without what it has, or with it."""
        if self.row is not None and isinstance(self.row.item, Owner):
            (self.folded.add if folded else self.folded.discard)(self.row.key)
            self.post_message(self.Entered(self))
