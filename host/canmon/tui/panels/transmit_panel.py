"""The tab of the transmit list: frames that are sent cyclically or by hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType

from tickrig.host.canmon.tui.panels.panel import Panel
from tickrig.host.canmon.tui.settings.nested_settings import below, tables
from tickrig.host.canmon.tui.settings.transmit_settings import read_row, row_settings
from tickrig.host.canmon.tui.tasks.model import Model
from tickrig.host.canmon.tui.tasks.sending_bus import checked_bus, next_bus
from tickrig.host.canmon.tui.tasks.session import Session
from tickrig.host.canmon.tui.tasks.transmit_task import TransmitTask
from tickrig.host.canmon.tui.widgets.ask_line import AskLine
from tickrig.host.canmon.tui.widgets.choice_view import ChoiceView
from tickrig.host.canmon.tui.widgets.title_line import TitleLine
from tickrig.host.monitor.transmit.transmit_text import ON, render_transmit
from tickrig.host.monitor.transmit.transmit_words import TransmitWords, parse_words
from tickrig.host.tui.line import plain

QUESTION = "FRAME [--every TIME] [--counter BYTE:LOW..HIGH] [--checksum BYTE:KIND] [--name NAME]"


class TransmitPanel(Panel):
    """Rows, each with a frame, a period, and fields that change."""

    title = "transmit"
    section = "transmit"
    HELP = """
    # Transmit

    Nothing is sent until the monitor is armed (A), and arming sends nothing by itself. Then space
    sends the chosen row in each of its periods, or no more; Enter sends it once. F9 stops all.

    A row is written as for `canmon send`: `123#DEADBEEF`, `5.rpdo1 target_velocity=100`,
    `100#0000 --every 20ms --counter 0:0..14 --checksum 1:crc8 --name alive`. Checksums: xor, sum8,
    neg8, crc8, crc8-2f, crc8-07. A `*` behind a frame: fields of it change each time.
    """
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
        super().__init__(session)
        self.transmit = TransmitTask(session.model.eds)
        session.tasks.append(self.transmit)
        self._lines: list[str] = []

    def compose(self) -> ComposeResult:
        """Lay out the list."""
        yield TitleLine("head")
        yield ChoiceView()
        yield AskLine()

    @property
    def chosen(self) -> int:
        """The number of the chosen row."""
        return self.query_one(ChoiceView).chosen

    def snapshot(self, model: Model) -> None:
        """Keep the list."""
        self._lines = render_transmit(self.transmit.list.rows)

    def paint(self) -> None:
        """Show it."""
        head, *rows = self._lines
        bus = f"   bus {self.transmit.channel}" if self.transmit.channel else ""
        self.query_one("#head", TitleLine).show(head + bus)
        rows = rows or ["no rows: a adds one"]
        self.query_one(ChoiceView).show(
            [plain(row, "bold green" if row.startswith(ON) else "") for row in rows]
        )

    def load(self, settings: Mapping[str, Any]) -> None:
        """Take the bus and the rows; none of them is enabled."""
        self.transmit.channel = checked_bus(self.session, settings)
        for number, table in enumerate(tables(settings, "row")):
            with below("row", number):
                self.transmit.add(read_row(table))

    def save(self) -> dict[str, Any]:
        """Return them."""
        rows = [row_settings(words) for words in self.transmit.words]
        return {"bus": self.transmit.channel, "row": rows}

    def action_enable(self) -> None:
        """Send the chosen row in each period, or no more."""
        session = self.session
        self._act(lambda number: self.transmit.enable(number, session.now_us, armed=session.armed))

    def action_once(self) -> None:
        """Send the chosen row now."""
        self._act(lambda number: self.transmit.once(number, armed=self.session.armed))

    def action_add(self) -> None:
        """Write a new row."""
        self.query_one(AskLine).ask(QUESTION, "", self._add)

    def action_edit(self) -> None:
        """Write the chosen row anew."""
        number = self.chosen
        if number < len(self.transmit.words):
            self.query_one(AskLine).ask(
                QUESTION, str(self.transmit.words[number]), lambda text: self._change(number, text)
            )

    def action_remove(self) -> None:
        """Take out the chosen row."""
        self._act(self.transmit.remove)

    def action_stop(self) -> None:
        """Send no row any more."""
        with self.session.lock:
            self.transmit.stop()
        self.look()

    def action_bus(self) -> None:
        """Send on the next bus."""
        with self.session.lock:
            self.transmit.stop()
            self.transmit.channel = next_bus(self.session, self.transmit.channel)
        self.look()

    def _act(self, act: Callable[[int], None]) -> None:
        if self.chosen >= len(self.transmit.words):
            return
        try:
            with self.session.lock:
                act(self.chosen)
        except ValueError as error:
            how = "" if self.session.armed else "; A arms"
            self.notify(f"{error}{how}", markup=False)
        self.look()

    def _add(self, text: str) -> None:
        words = parse_words(text)
        with self.session.lock:
            self.transmit.add(words)
        self.look()
        self.query_one(ChoiceView).choose(len(self.transmit.words) - 1)

    def _change(self, number: int, text: str) -> None:
        words: TransmitWords = parse_words(text)
        with self.session.lock:
            self.transmit.change(number, words)
        self.look()
