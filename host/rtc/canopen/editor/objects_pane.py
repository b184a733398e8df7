"""The pane with the objects of the chosen node."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Final

from tickrig.host.canmon.model.decode.decoded import write_entry
from tickrig.host.canmon.model.decode.node_memory import (
    EdsObjects,
    Entry,
    ObjectText,
    read_eds_objects,
)
from tickrig.host.rtc.canopen.served_node import NodePhase
from tickrig.host.rtc.canopen.view import PendingTransfer, ServerView
from tickrig.host.rtc.editor.styles import ALARM, DIM, LIT
from tickrig.host.rtc.editor.widgets import CursorRow, CursorView
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_file import EdsError
from tickrig.wire.canopen.eds.eds_value import parse_value
from tickrig.wire.errors import FieldError

_AT_ONCE: Final = 8
"""Number of running transfers. A command to the node waits for this number of transfers."""

_FIRST_INDEX: Final = 0x1000
"""First index of objects. Lower indices are data types (CiA 301, object dictionary)."""

_NAME: Final = 30
"""Number of columns of a name."""


_ObjectRow = CursorRow[Entry]


class _NodeObjects:
    """The visible objects of a node, which are read and written by SDO.

    Each object is read once when it becomes visible, or repeatedly if the pane is live. An object
    that could not be read is read again only on request.

    Args:
        node_id: node-ID of the node.
        eds: content of the node's EDS.

    Attributes:
        node_id: node-ID of the node.
        live: whether visible objects are read repeatedly.
    """

    def __init__(self, node_id: int, eds: EdsObjects) -> None:
        self.node_id, self._eds = node_id, eds
        self.live = False
        self._values: dict[Entry, bytes] = {}
        self._changed: set[Entry] = set()
        self._problems: dict[Entry, str] = {}
        self._reads, self._ages = 0, dict[Entry, int]()
        self._wanted: list[Entry] = []
        self._rows: dict[Entry, tuple[object, _ObjectRow]] = {}
        self._reading: dict[Entry, PendingTransfer[bytes]] = {}
        self._writing: list[tuple[Entry, PendingTransfer[bytes]]] = []

    @property
    def rows(self) -> list[_ObjectRow]:
        """The objects of the node by index."""
        texts = sorted(self._eds.texts.items())
        return [self._kept_row(entry, text) for entry, text in texts if entry[0] >= _FIRST_INDEX]

    def look(self, view: ServerView, seen: Collection[Entry], *, answers: bool) -> None:
        """Process the results of SDO requests, and request missing values of visible objects.

        Args:
            view: view that sends commands to the server.
            seen: visible objects.
            answers: whether the node answers SDO requests.
        """
        self._take_written()
        for entry, transfer in tuple(self._reading.items()):
            if transfer.done:
                del self._reading[entry]
                self._take(entry, transfer)
        if not answers:
            self._wanted.clear()
            return
        for entry in (*self._wanted, *self._due(seen)):
            if len(self._reading) < _AT_ONCE and entry not in self._reading:
                self._wanted = [one for one in self._wanted if one != entry]
                self._reading[entry] = view.read(self.node_id, *entry)

    def read(self, entry: Entry) -> None:
        """Queue a read of an object."""
        self._problems.pop(entry, None)
        self._wanted.append(entry)

    def write(self, view: ServerView, entry: Entry, words: str) -> None:
        """Write a value typed by the user to an object, and read the object afterwards.

        Raises:
            ValueError: the value does not fit the type of the object.
        """
        data = _encode_words(self._eds.texts[entry], words)
        self._writing.append((entry, view.write(self.node_id, *entry, data)))

    def text_of(self, entry: Entry) -> ObjectText:
        """Return the description of an object."""
        return self._eds.texts[entry]

    def value_of(self, entry: Entry) -> str:
        """Return the value in the notation for writing, empty if it is unknown."""
        data = self._values.get(entry)
        return "" if data is None else _words_of(self.text_of(entry), data)

    def forget(self) -> None:
        """Drop all values, because the node has started again."""
        self._values.clear()
        self._problems.clear()
        self._changed.clear()

    def _due(self, seen: Collection[Entry]) -> list[Entry]:
        """Return the visible objects to read. The object with the oldest value is first."""
        due = [
            entry
            for entry in seen
            if entry not in self._problems and (self.live or entry not in self._values)
        ]
        return sorted(due, key=lambda entry: self._ages.get(entry, 0))

    def _take(self, entry: Entry, transfer: PendingTransfer[bytes]) -> None:
        if transfer.problem:
            self._problems[entry] = _reason(entry, transfer)
            return
        self._reads += 1
        self._ages[entry] = self._reads
        before = self._values.get(entry)
        self._values[entry] = transfer.data
        if before in (None, transfer.data):
            self._changed.discard(entry)
        else:
            self._changed.add(entry)

    def _take_written(self) -> None:
        for entry, transfer in [one for one in self._writing if one[1].done]:
            self._writing.remove((entry, transfer))
            if transfer.problem:
                self._problems[entry] = _reason(entry, transfer)
            else:
                self.read(entry)

    def _kept_row(self, entry: Entry, text: ObjectText) -> _ObjectRow:
        """Return the row of an object. The row is formatted again if something changed."""
        known = self._values.get(entry), self._problems.get(entry), entry in self._changed
        kept = self._rows.get(entry)
        if kept is None or kept[0] != known:
            kept = self._rows[entry] = known, self._row(entry, text)
        return kept[1]

    def _row(self, entry: Entry, text: ObjectText) -> _ObjectRow:
        data, problem = self._values.get(entry), self._problems.get(entry)
        kind = "" if text.kind is None else text.kind.name
        value = "" if data is None else f"{text.read(data)[1]} {text.unit}"
        head = (f"{write_entry(entry)} ", DIM), (f"{_tail(text.name):<{_NAME}} ", "")
        style = LIT if entry in self._changed else "bold"
        rest = ((problem, ALARM),) if problem else ((f"{kind:<14} ", DIM), (value, style))
        return CursorRow(write_entry(entry), (*head, *rest), entry)


def _reason(entry: Entry, transfer: PendingTransfer[bytes]) -> str:
    """Return why a transfer failed, in the space that a row of 80 columns leaves."""
    return transfer.problem.removeprefix(f"{write_entry(entry)} ").removeprefix("aborted: ")


def _tail(name: str) -> str:
    """Return the end of a long name, because members of a record have the same beginning."""
    return name if len(name) <= _NAME else f"…{name[1 - _NAME :]}"


def _encode_words(text: ObjectText, words: str) -> bytes:
    """Return the bytes of a value in EDS notation.

    Raise ValueError if the value does not fit the type.

    >>> _encode_words(ObjectText("mode", DataType.INTEGER8), "-2").hex()
    'fe'
    """
    kind = text.kind or DataType.DOMAIN
    try:
        return kind.encode(parse_value(kind, words.strip())[0])
    except ValueError:
        raise ValueError(f"{words!r} is no {kind.name}") from None


def _words_of(text: ObjectText, data: bytes) -> str:
    r"""Return the words from which `_encode_words` makes these bytes.

    >>> _words_of(ObjectText("mode", DataType.INTEGER8), b"\xfe")
    '-2'
    """
    try:
        value = data if text.kind is None else text.kind.decode(data)
    except FieldError:
        return ""
    return value.hex(" ").upper() if isinstance(value, bytes) else str(value)


class ObjectsPane(CursorView[Entry]):
    """Pane of the CANopen editor that shows the object dictionary of one node at a time.

    Attributes:
        objects: objects of the node, or None if no node is shown.
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
        """Clear the pane for another system."""
        self.objects: _NodeObjects | None = None
        self._of: dict[int, _NodeObjects] = {}

    def turn_to(self, node_id: int, eds: Mapping[int, Path]) -> None:
        """Show the objects of a node, or no objects for node-ID 0.

        The EDS of the node is read at the first call.

        Args:
            node_id: node-ID of the node, or 0.
            eds: paths of the EDS files by node-ID.
        """
        if node_id and node_id not in self._of:
            self._of[node_id] = _read(node_id, eds[node_id])
        self.objects = self._of.get(node_id)

    def look(self, view: ServerView) -> None:
        """Read the visible objects. The server waits during this time."""
        if (objects := self.objects) is None:
            self.title = "objects"
            return
        node = view.node(objects.node_id)
        if node.phase is not NodePhase.READY:
            objects.forget()
        answers = node.phase is NodePhase.READY and node.nmt_state != "STOPPED"
        objects.look(view, [row.item for row in self.in_view], answers=answers)
        live = ", live" if objects.live else ""
        self.title = f"objects of {node.node_id} {node.name}{live}"

    def paint_objects(self) -> None:
        """Show the known data of the objects."""
        self.offer([] if self.objects is None else self.objects.rows)


def _read(node_id: int, path: Path) -> _NodeObjects:
    """Return the objects of an EDS, or none if the file no longer exists."""
    try:
        return _NodeObjects(node_id, read_eds_objects(path, node_id))
    except (OSError, EdsError):
        return _NodeObjects(node_id, EdsObjects())
