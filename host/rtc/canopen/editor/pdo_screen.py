"""The screen for the PDOs of one node, with mapping, transmission, and links."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import ModalScreen

from tickrig.host.rtc.canopen import pdo_edit
from tickrig.host.rtc.canopen.definition import TPDOS, DeviceFile, PdoLink, PdoName, ServerRefused
from tickrig.host.rtc.canopen.editor.session import EditorSession
from tickrig.host.rtc.canopen.served_node import NodePhase
from tickrig.host.rtc.canopen.view import PendingTransfer, ServerView
from tickrig.host.rtc.editor.styles import ALARM, DIM, LIT
from tickrig.host.rtc.editor.widgets import ChoiceScreen, CursorRow, CursorView, QuestionScreen
from tickrig.host.text.values import counted
from tickrig.host.tui import KeyFooter, Line, LineView, plain
from tickrig.wire.canopen.pdo import MAX_PDO_BITS, MappedObject, PdoDescription, fields

_GOOD: Final = "bold green"
_NAME: Final = 40
"""Number of columns of the name of an object."""

_BIT_RATE: Final = 1_000_000
"""Bit rate in a DCF if the System Definition does not give a bit rate."""


@dataclass(frozen=True, slots=True)
class _PdoPlace:
    """A row of the screen.

    Attributes:
        index: index of the communication parameter of the PDO.
        entry: position in the mapping, from 0, or -1 for the PDO itself.
    """

    index: int
    entry: int = -1


def _pdo_rows(
    node_id: int,
    pdos: pdo_edit.Pdos,
    wanted: pdo_edit.Pdos,
    names: Mapping[tuple[int, int], str],
    links: tuple[PdoLink, ...],
) -> list[CursorRow[_PdoPlace]]:
    """Return the rows of the PDOs of a node.

    Args:
        node_id: node-ID of the node.
        pdos: PDOs that the node has.
        wanted: PDOs that were changed on this screen.
        names: names of objects, by index and sub-index.
        links: PDO links of the whole system.
    """
    rows = []
    for index, there in pdos.items():
        pdo = wanted.get(index, there)
        name = pdo_edit.pdo_name(node_id, index)
        rows.append(CursorRow(f"{name}", _pdo_line(name, pdo, there, links), _PdoPlace(index)))
        for place, (mapped, shift) in enumerate(fields(pdo.mapping)):
            at = mapped.index, mapped.sub
            line: Line = (
                (f"   {place + 1:>2}  ", DIM),
                (f"{mapped.index:04X}h:{mapped.sub:02X}", ""),
                (f"  bit {shift:>2}  {mapped.bits:>2} bits  ", DIM),
                (names.get(at, "dummy" if mapped.index < 0x20 else "not in the EDS")[:_NAME], ""),
            )
            rows.append(CursorRow(f"{name} {place}", line, _PdoPlace(index, place)))
    return rows


def _pdo_line(
    name: PdoName, pdo: PdoDescription, there: PdoDescription, links: tuple[PdoLink, ...]
) -> Line:
    bits = sum(value & 0xFF for value in pdo.mapping)
    targets = [f"→ {link.target}" for link in links if link.source == name]
    targets += [f"← {link.source}" for link in links if link.target == name]
    return (
        (f"{name!s:<11}", "bold"),
        (f" {name.index:04X}h  ", DIM),
        ("on  " if pdo.enabled else "off ", _GOOD if pdo.enabled else DIM),
        (f"{pdo.can_id:03X}h  type {pdo.transmission_type:>3}  ", ""),
        (f"{bits:>2} of {MAX_PDO_BITS} bits ", ALARM if bits > MAX_PDO_BITS else ""),
        (" changed" if pdo != there else "", LIT),
        ("".join(f"  {text}" for text in targets), "green"),
    )


class PdoScreen(ModalScreen[None]):
    """Screen of the CANopen editor on which the user changes the PDOs of a node.

    The changes are sent to the node only when the user writes them.

    Args:
        session: session with the server.
        node_id: node-ID of the node.

    Attributes:
        pdos: PDOs that the node has, empty before they were read.
        wanted: PDOs that the user has changed and not written yet.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("i", "insert", "insert"),
        Binding("x,delete", "remove", "remove", key_display="x"),
        Binding("c", "cob_id", "COB-ID"),
        Binding("t", "type", "type"),
        Binding("o", "switch", "on/off"),
        Binding("k", "link", "link/cut"),
        Binding("w", "write", "write to the node"),
        Binding("u", "undo", "undo"),
        Binding("g", "read", "read again"),
        Binding("ctrl+s", "save", "save DCF", key_display="^s"),
        Binding("ctrl+o", "load", "load DCF", key_display="^o"),
        Binding("escape,q", "leave", "leave", key_display="esc"),
    ]
    CSS = """
    PdoScreen { background: $background; }
    PdoScreen CursorView { height: 1fr; border: round $accent; }
    PdoScreen #pdo-status { height: 2; background: $boost; }
    """

    def __init__(self, session: EditorSession, node_id: int) -> None:
        super().__init__()
        self._session, self._node_id = session, node_id
        self.view = CursorView[_PdoPlace]("pdos")
        self.status = LineView("pdo-status")
        self.pdos: dict[int, PdoDescription] = {}
        self.wanted: dict[int, PdoDescription] = {}
        self._file: DeviceFile | None = None
        self._reading: PendingTransfer[pdo_edit.Pdos] | None = None
        self._writing: PendingTransfer[None] | None = None
        self._saving: tuple[PendingTransfer[Mapping[int, bytes]], Path, Path] | None = None
        self._says: Line = plain("")
        self._read_once = self._warned = self._busy_hit = False

    def compose(self) -> ComposeResult:
        """Lay out the screen."""
        yield self.view
        yield self.status
        yield KeyFooter()

    def on_mount(self) -> None:
        """Read the PDOs."""
        self.status.can_focus = False
        self.view.focus()
        self.look()

    # The display, and the results of transfers.

    def look(self) -> None:
        """Update the screen with the present state of the node.

        The app calls this method ten times a second, and after each command.
        """
        if not self.is_mounted:
            return
        with self._session.lock:
            view = self._session.view
            try:
                node = view.node(self._node_id)
                self._file = view.device_file(self._node_id)
            except ServerRefused:  # another definition was loaded
                self.dismiss(None)
                return
            links = view.links
        self._take()
        if node.phase is not NodePhase.READY:
            self._read_once = False  # what comes back may be another device, or have other values
        elif not self._read_once and self._reading is None:
            with self._session.lock, suppress(ServerRefused):  # the next look tries again
                self._begin_reading(self._session.view)
        title = f"PDOs of {node.node_id} {node.name}"
        state = node.proxy_state.capitalize() or node.phase.value
        problem = f": {node.problem}" if node.problem else ""
        self.view.title = f"{title}: {'lost' if node.late else state}{problem}"
        names = dict.fromkeys(self._file.data_types, "not mappable by its EDS")
        names |= {(one.mapped.index, one.mapped.sub): one.name for one in self._file.mappable}
        self.view.offer(_pdo_rows(self._node_id, self.pdos, self.wanted, names, links))
        width = max(20, int(self.status.scrollable_content_region.width) - 1)
        ((text, style),) = self._status()
        self.status.show([plain(f" {part}", style) for part in wrap(text.strip(), width)])

    def _status(self) -> Line:
        hint = "; keys change nothing until it ends" if self._busy_hit else ""
        if self._writing is not None:
            return plain(f" writing to the node ...{hint}", LIT)
        if self._reading is not None or self._saving is not None:
            return plain(f" reading the node ...{hint}", DIM)
        self._busy_hit = False
        if self._says[0][0]:
            return self._says
        if not self.pdos:
            return plain(" waits for the node", DIM)
        if self.wanted:
            return plain(f" {len(self.wanted)} changed, not written: w writes, u undoes", LIT)
        return plain(" as in the node", DIM)

    def _take(self) -> None:
        """Process the results of transfers."""
        if (reading := self._reading) is not None and reading.done:
            self._reading = None
            if reading.problem:
                self._note(reading.problem, ALARM)
            else:
                self.pdos = dict(reading.data)
                there, wanted = self.pdos, self.wanted.items()
                self.wanted = {i: p for i, p in wanted if i in there and p != there[i]}
        if (writing := self._writing) is not None and writing.done:
            self._writing = None
            if writing.problem:
                self._note(writing.problem, ALARM)
            else:
                self._note("written, and read back", _GOOD)
                self.pdos |= self.wanted
                self.wanted.clear()
            self._read_once = False
        if self._saving is not None and self._saving[0].done:
            self._save_values(*self._saving)
            self._saving = None

    def _note(self, text: str, style: str = "") -> None:
        self._says = plain(f" {text}", style)

    def _begin_reading(self, view: ServerView) -> None:
        self._reading = view.read_pdos(self._node_id)
        self._read_once = True

    # Keys.

    def action_read(self) -> None:
        """Read the PDOs again. Changes on this screen are kept."""
        if not self._is_busy():
            self._command(self._begin_reading)

    def action_insert(self) -> None:
        """Ask the user for an object, and map it into the PDO after the entry under the cursor.

        If the cursor is on the PDO itself, the object becomes the last entry.
        """
        if (at := self._at()) is not None:
            pdo = self.wanted.get(at.index, self.pdos[at.index])
            place = len(pdo.mapping) if at.entry < 0 else at.entry + 1
            self._choose_object(at, place, insert=True)

    def on_cursor_view_entered(self, event: CursorView.Entered) -> None:
        """Replace the entry under the cursor. For a PDO, ask for its COB-ID."""
        event.stop()
        if (at := self._at()) is None:
            return
        if at.entry < 0:
            self.action_cob_id()
        else:
            self._choose_object(at, at.entry, insert=False)

    def on_cursor_view_moved(self, event: CursorView.Moved) -> None:
        """Stop the event, so that the screen below does not get it."""
        event.stop()

    def action_remove(self) -> None:
        """Remove the entry under the cursor."""
        if (at := self._at()) is None:
            return
        if at.entry < 0:
            self._refuse("go to an entry of a PDO to remove it; o switches a PDO off")
        else:
            self._change(at.index, lambda pdo: pdo_edit.with_entry(pdo, at.entry, None))

    def action_cob_id(self) -> None:
        """Ask for the COB-ID of the PDO under the cursor."""
        self._prompt("COB-ID of", lambda pdo: f"0x{pdo.can_id:03X}", pdo_edit.with_cob_id)

    def action_type(self) -> None:
        """Ask for the transmission type of the PDO under the cursor."""
        at = self.view.row
        sends = at is not None and at.item.index in TPDOS
        self._prompt(
            "transmission type (0..240 SYNC, 254 and 255 events) of",
            lambda pdo: str(pdo.transmission_type),
            lambda pdo, words: pdo_edit.with_type(pdo, words, sends=sends),
        )

    def action_switch(self) -> None:
        """Switch the PDO under the cursor on or off."""
        if (at := self._at()) is not None:
            self._change(at.index, pdo_edit.switched)

    def action_undo(self) -> None:
        """Undo all changes that are not written."""
        if not self._is_busy():
            self.wanted.clear()
            self._says = plain("")
            self.look()

    def action_write(self) -> None:
        """Write the changes to the node."""
        if self._is_busy():
            return
        if not self.wanted:
            self._refuse("nothing was changed")
            return
        wanted = dict(self.wanted)

        def write(view: ServerView) -> None:
            self._writing = view.write_pdos(self._node_id, dict(self.pdos), wanted)

        self._command(write)

    def action_link(self) -> None:
        """Link the PDO under the cursor with a PDO of another node, or remove such a link.

        If an RPDO has a link, that link is removed. Otherwise, the user selects the other PDO. If
        the two PDOs are linked already, their link is removed. If not, they are linked.
        """
        if (at := self._at()) is None:
            return
        if self.wanted:
            self._refuse("write or undo the changes first: w writes, u undoes")
            return
        name = pdo_edit.pdo_name(self._node_id, at.index)
        with self._session.lock:
            view = self._session.view
            links = {
                link.target if link.source == name else link.source
                for link in view.links
                if name in (link.source, link.target)
            }
            nodes = view.nodes

        def chosen(other: PdoName) -> None:
            ends = (name, other) if at.index in TPDOS else (other, name)
            change = ServerView.unlink if other in links else ServerView.link
            self._command(lambda view: change(view, *ends))

        if links and at.index not in TPDOS:  # it has one source
            chosen(next(iter(links)))
            return
        rows = [
            CursorRow(
                str(pdo.name),
                (
                    (f"{pdo.name!s:<12} ", ""),
                    (f"{pdo.bits:>2} bits  {node.name}", DIM),
                    ("  linked: cut" if pdo.name in links else "", LIT),
                ),
                pdo.name,
            )
            for node in nodes
            for pdo in node.pdos
            if node.node_id != self._node_id and (pdo.index in TPDOS) != (at.index in TPDOS)
        ]
        if rows:
            ChoiceScreen(f"link {name} with, or cut the link", rows).prompt(self.app, chosen)
        else:
            self._refuse("no other node has a PDO of the other direction that is on")

    def action_save(self) -> None:
        """Ask for a file, and save the values of the node as a DCF."""
        if self._is_busy():
            return
        with self._session.lock:
            eds = self._session.eds_paths[self._node_id]
        path = eds.with_name(f"{eds.stem}-{self._node_id}.dcf")

        def answered(text: str) -> None:
            def read(view: ServerView) -> None:
                self._saving = view.read_parameters(self._node_id, eds), Path(text), eds

            if text:
                self._command(read)

        QuestionScreen("save the node as DCF", str(path)).prompt(self.app, answered)

    def action_load(self) -> None:
        """Ask for a DCF, and use its PDOs as changes."""
        if self._is_busy() or self._at() is None or (file := self._file) is None:
            return

        def answered(text: str) -> None:
            if not text:
                return
            with self._refused_at(text):
                wanted = pdo_edit.pdos_of_dcf(Path(text), self._node_id, file, self.pdos)
                self.wanted = dict(wanted)
                self._note(f"{text}: {counted(len(wanted), 'changed PDO')}: w writes", LIT)
                self.look()

        QuestionScreen("load the PDOs of a DCF", "").prompt(self.app, answered)

    def action_leave(self) -> None:
        """Leave the screen. If changes are not written, ask first."""
        if self.wanted and not self._warned:
            self._warned = True
            self._refuse(f"{len(self.wanted)} changed, not written: w writes, again leaves")
            return
        self.dismiss(None)

    # How they do it.

    def _at(self) -> _PdoPlace | None:
        """Return the row under the cursor, or None if nothing can be changed now."""
        if self._is_busy():
            return None
        if self.view.row is None:
            self._refuse("the PDOs of the node are not read yet")
            return None
        return self.view.row.item

    def _is_busy(self) -> bool:
        busy = self._writing is not None or self._saving is not None or self._reading is not None
        if busy:
            self._busy_hit = True
            self.look()
        return busy

    def _choose_object(self, at: _PdoPlace, place: int, *, insert: bool) -> None:
        if self._file is None:
            return
        rows = [
            CursorRow(
                f"{one.mapped.encode():08X}",
                (
                    (f"{one.mapped.index:04X}h:{one.mapped.sub:02X} ", ""),
                    (f"{one.mapped.bits:>2} bits  ", DIM),
                    (one.name, ""),
                ),
                one.mapped,
            )
            for one in pdo_edit.mappable(self._file, at.index)
        ]

        def chosen(mapped: MappedObject) -> None:
            self._change(
                at.index, lambda pdo: pdo_edit.with_entry(pdo, place, mapped, insert=insert)
            )

        name = pdo_edit.pdo_name(self._node_id, at.index)
        what = f"insert into {name}" if insert else f"entry {place + 1} of {name}"
        ChoiceScreen(what, rows).prompt(self.app, chosen)

    def _prompt(
        self,
        text: str,
        shown: Callable[[PdoDescription], str],
        change: Callable[[PdoDescription, str], PdoDescription],
    ) -> None:
        if (at := self._at()) is None:
            return
        pdo = self.wanted.get(at.index, self.pdos[at.index])

        def answered(words: str) -> None:
            self._change(at.index, lambda pdo: change(pdo, words))

        name = pdo_edit.pdo_name(self._node_id, at.index)
        QuestionScreen(f"{text} {name}", shown(pdo)).prompt(self.app, answered)

    def _change(self, index: int, change: Callable[[PdoDescription], PdoDescription]) -> None:
        """Change a PDO on this screen. The node gets the change when it is written."""
        if index not in self.pdos:  # removed by a later read
            return
        try:
            pdo = change(self.wanted.get(index, self.pdos[index]))
        except ValueError as error:
            self._refuse(str(error))
            return
        self._warned, self._says = False, plain("")
        self.wanted[index] = pdo
        if pdo == self.pdos[index]:
            del self.wanted[index]
        self.look()

    def _save_values(
        self, transfer: PendingTransfer[Mapping[int, bytes]], path: Path, eds: Path
    ) -> None:
        if transfer.problem:
            self._refuse(f"{path} is not written: {transfer.problem}")
            return
        bit_rate = self._session.server.definition.bus.bitrate or _BIT_RATE
        with self._refused_at(path):
            pdo_edit.save_dcf(path, eds, self._node_id, bit_rate, transfer.data)
            self._note(f"{path}: {counted(len(transfer.data), 'value')} saved", _GOOD)

    def _command(self, command: Callable[[ServerView], object]) -> None:
        self._says = plain("")
        try:
            with self._session.lock:
                command(self._session.view)
        except ValueError as error:
            self._refuse(str(error))
        else:
            self.look()

    @contextmanager
    def _refused_at(self, path: Path | str) -> Iterator[None]:
        """Show why a file cannot be read or written."""
        try:
            yield
        except OSError as error:
            self._refuse(f"{path}: {error.strerror}")
        except ValueError as error:
            self._refuse(str(error))

    def _refuse(self, why: str) -> None:
        self._note(why, ALARM)
        self.look()
