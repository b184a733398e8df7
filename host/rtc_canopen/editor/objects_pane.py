"""The objects of the node that was chosen."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tickrig.host.monitor.decode.node_memory import EdsObjects, Entry, read_eds
from tickrig.host.rtc_canopen.editor.cursor_view import CursorView
from tickrig.host.rtc_canopen.editor.node_objects import NodeObjects
from tickrig.host.rtc_canopen.node.served_node import Phase
from tickrig.host.rtc_canopen.view import ServerView
from tickrig.wire.canopen.eds.eds_finding import EdsError


class ObjectsPane(CursorView[Entry]):
    """Shows the objects of one node at a time.

    Attributes:
        objects: those of the node, None without one.
    """

    HELP = """
    # Objects

    Those that the EDS of the node has, in whose rows the cursor of the system is. Each is read
    by SDO when it comes into view; while they are live, again and again. A value that changed
    is yellow, a refusal red.

    Numbers are written as 12, -2 or 0x1F, bytes as 37 02. A double click writes.
    """

    def __init__(self) -> None:
        super().__init__("objects")
        self.forget()

    def forget(self) -> None:
        """Begin anew, with another system."""
        self.objects: NodeObjects | None = None
        self._of: dict[int, NodeObjects] = {}

    def turn_to(self, node_id: int, eds: Mapping[int, Path]) -> None:
        """Show the objects of a node from now on, 0 for none; reads its EDS the first time."""
        if node_id and node_id not in self._of:
            self._of[node_id] = _read(node_id, eds[node_id])
        self.objects = self._of.get(node_id)

    def look(self, view: ServerView) -> None:
        """Read those in view; the server waits meanwhile."""
        if (objects := self.objects) is None:
            self.title = "objects"
            return
        node = view.node(objects.node_id)
        if node.phase is not Phase.READY:
            objects.forget()
        answers = node.phase is Phase.READY and node.nmt_state != "STOPPED"
        objects.look(view, [row.item for row in self.in_view], answers=answers)
        live = ", live" if objects.live else ""
        self.title = f"objects of {node.node_id} {node.name}{live}"

    def paint_objects(self) -> None:
        """Show what is known of them."""
        self.offer([] if self.objects is None else self.objects.rows)


def _read(node_id: int, path: Path) -> NodeObjects:
    """Return the objects of an EDS; none if it is there no more."""
    try:
        return NodeObjects(node_id, read_eds(path, node_id))
    except (OSError, EdsError):
        return NodeObjects(node_id, EdsObjects())
