"""The tab of the transmit list, with frames that are sent cyclically or by hand.

>>> _read_row({"send": "080#", "every": "10ms"}).every
'10ms'
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType

from tickrig.host.canmon.model import transmit
from tickrig.host.canmon.model.decode.node_memory import EdsObjects
from tickrig.host.canmon.tui.panels import panel
from tickrig.host.canmon.tui.session import DecodedFrame, Model, Session, Task
from tickrig.host.canmon.workspace import below, tables, text_of, texts_of
from tickrig.host.tui import plain
from tickrig.wire.can import CanFrame, FdFrame


def _read_row(settings: Mapping[str, Any]) -> transmit.RowText:
    """Return the row that settings describe. Raise SettingError if a setting is invalid."""
    return transmit.RowText(
        text_of(settings, "send", ""),
        text_of(settings, "every", ""),
        texts_of(settings, "counter"),
        texts_of(settings, "checksum"),
        text_of(settings, "name", ""),
    )


def _row_settings(words: transmit.RowText) -> dict[str, Any]:
    """Return a row as settings. Empty values are None, so that a workspace omits them."""
    return {
        "send": words.frame,
        "every": words.every or None,
        "counter": list(words.counters) or None,
        "checksum": list(words.checksums) or None,
        "name": words.name or None,
    }


_NOW: Final = 0
"""Due time of frames that are sent by hand."""


class TransmitTask(Task):
    """Task that sends the rows of the monitor's transmit list, cyclically or by hand.

    Args:
        eds: content of EDS files by node-ID.
        channel: name of the bus on which the task sends, empty for the first bus.

    Attributes:
        words: text of each row, as the user edits it.
        list: transmit list with the frames of the rows.
    """

    def __init__(self, eds: Mapping[int, EdsObjects], channel: str = "") -> None:
        self.channel = channel
        self.words: list[transmit.RowText] = []
        self.list = transmit.TransmitList()
        self._pdos = transmit.PdoFrames(eds)
        self._out: list[CanFrame | FdFrame] = []

    @property
    def due_us(self) -> int:
        """Time at which the next call is due."""
        return _NOW if self._out else self.list.due_us

    def add(self, words: transmit.RowText) -> None:
        """Add a row at the end. Raise ValueError if the row cannot be sent."""
        self.list.rows.append(words.row(self._pdos))
        self.words.append(words)

    def change(self, number: int, words: transmit.RowText) -> None:
        """Replace a row of the transmit list. The old row is no longer sent.

        Args:
            number: number of the row, from 0.
            words: text of the new row.

        Raises:
            ValueError: the text is invalid, as for `add`.
        """
        self.list.rows[number] = words.row(self._pdos)
        self.words[number] = words

    def remove(self, number: int) -> None:
        """Remove a row."""
        del self.list.rows[number], self.words[number]

    def enable(self, number: int, now_us: int, *, armed: bool) -> None:
        """Start to send a row cyclically. If the row is already sent cyclically, stop instead.

        Args:
            number: number of the row, from 0.
            now_us: present time in microseconds.
            armed: whether sending is armed.

        Raises:
            ValueError: sending is not armed, or the row has no period.
        """
        row = self.list.rows[number]
        if row.enabled:
            row.disable()
            return
        self.list.armed = armed
        self.list.enable(number, now_us)
        self._remember(number)

    def once(self, number: int, *, armed: bool) -> None:
        """Send a row now. Raise ValueError if the list is not armed."""
        self.list.armed = armed
        if armed:
            self._remember(number)
        self._out += self.list.once(number)

    def _remember(self, number: int) -> None:
        """Set the objects that a row of a PDO does not name to the values that were sent last."""
        words, row = self.words[number], self.list.rows[number]
        if "#" not in words.frame:
            row.frame = self._pdos.frame(words.frame)
            self._pdos.remember(words.frame)

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> transmit.AnyFrames:
        """Return the frames that are due."""
        out, self._out = self._out, []
        return (*out, *self.list.tick(now_us))

    def stop(self) -> None:
        """Disable all rows."""
        self.list.stop()
        self._out.clear()


_QUESTION = "FRAME [--every TIME] [--counter BYTE:LOW..HIGH] [--checksum BYTE:KIND] [--name NAME]"


class TransmitPanel(panel.SendingPanel):
    """A list of rows, each with a frame, a period, and fields that change."""

    title = "transmit"
    section = "transmit"
    HELP = panel.read_help(__file__)
    DEFAULT_CSS = "TransmitPanel #head { text-style: bold; }"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space", "enable", "on/off"),
        Binding("enter", "once", "send once"),
        Binding("a", "add", "add"),
        Binding("e", "edit", "edit"),
        Binding("x", "remove", "remove"),
        Binding("s", "stop", "all off"),
        Binding("b", "bus", "bus"),
    ]

    def __init__(self, session: Session) -> None:
        self.transmit = TransmitTask(session.model.eds)
        super().__init__(session, self.transmit)
        self._lines: list[str] = []

    def compose(self) -> ComposeResult:
        """Lay out the list."""
        yield panel.TitleLine("head")
        yield panel.ChoiceView()
        yield panel.PromptLine()

    @property
    def chosen(self) -> int:
        """The number of the selected row."""
        return self.query_one(panel.ChoiceView).chosen

    def snapshot(self, model: Model) -> None:
        """Copy the list."""
        self._lines = transmit.render_transmit(self.transmit.list.rows)

    def paint(self) -> None:
        """Show the snapshot."""
        head, *rows = self._lines
        bus = f"   bus {self.transmit.channel}" if self.transmit.channel else ""
        self.query_one("#head", panel.TitleLine).show(head + bus)
        rows = rows or ["no rows: a adds one"]
        self.query_one(panel.ChoiceView).show(
            [plain(row, "bold green" if row.startswith(transmit.ON) else "") for row in rows]
        )

    def load(self, settings: Mapping[str, Any]) -> None:
        """Load the bus and the rows. No row is enabled."""
        super().load(settings)
        for number, table in enumerate(tables(settings, "row")):
            with below("row", number):
                self.transmit.add(_read_row(table))

    def save(self) -> dict[str, Any]:
        """Return the bus and the rows."""
        rows = [_row_settings(words) for words in self.transmit.words]
        return {"bus": self.transmit.channel, "row": rows}

    def action_enable(self) -> None:
        """Send the selected row in each period, or stop this."""
        session = self.session
        self._act(lambda number: self.transmit.enable(number, session.now_us, armed=session.armed))

    def action_once(self) -> None:
        """Send the selected row now."""
        self._act(lambda number: self.transmit.once(number, armed=self.session.armed))

    def action_add(self) -> None:
        """Ask for a new row."""
        self.query_one(panel.PromptLine).prompt(_QUESTION, "", self._add)

    def action_edit(self) -> None:
        """Edit the selected row."""
        number = self.chosen
        if number < len(self.transmit.words):
            self.query_one(panel.PromptLine).prompt(
                _QUESTION, str(self.transmit.words[number]), lambda text: self._change(number, text)
            )

    def action_remove(self) -> None:
        """Remove the selected row."""
        self._act(self.transmit.remove)

    def _act(self, act: Callable[[int], None]) -> None:
        if self.chosen >= len(self.transmit.words):
            return
        try:
            with self.session.lock:
                act(self.chosen)
        except ValueError as error:
            how = "" if self.session.armed else "; A arms"
            self.notify(f"{error}{how}", markup=False)
        self.refresh_view()

    def _add(self, text: str) -> None:
        words = transmit.parse_row_text(text)
        self.change(lambda: self.transmit.add(words))
        self.query_one(panel.ChoiceView).choose(len(self.transmit.words) - 1)

    def _change(self, number: int, text: str) -> None:
        words: transmit.RowText = transmit.parse_row_text(text)
        self.change(lambda: self.transmit.change(number, words))
