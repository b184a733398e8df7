"""The tab of the sequences: an editor, and what a sequence does when it runs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.widgets import Static, TextArea

from tickrig.host.canmon.model.sequence import (
    EventType,
    Sequence,
    SequenceEvent,
    event_line,
    outline,
)
from tickrig.host.canmon.tui import sequence_task
from tickrig.host.canmon.tui.controls import PromptLine, TitleLine
from tickrig.host.canmon.tui.panels.panel import SendingPanel, read_help
from tickrig.host.canmon.tui.session import Model, Session
from tickrig.host.text.steps import StepError
from tickrig.host.text.whole_file import write_whole
from tickrig.host.tui import Line, LineView, plain

_STYLES: Final = {EventType.MET: "green", EventType.MISSED: "bold red", EventType.END: "bold"}
_PLACE: Final = re.compile(r".*?:([0-9]+): ")


class SequencePanel(SendingPanel):
    """Sequences, one of them in the editor."""

    title = "sequence"
    section = "sequence"
    HELP = read_help(__file__)
    DEFAULT_CSS = """
    SequencePanel #state { background: $boost; }
    SequencePanel #mistake { display: none; height: auto; color: $error; }
    SequencePanel LineView { width: 1fr; height: 1fr; }
    SequencePanel TextArea { width: 1fr; height: 1fr; border: none; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("f5", "run", "run", key_display="F5"),
        Binding("f6", "stop", "stop", key_display="F6"),
        Binding("f7", "steps", "steps", key_display="F7"),
        Binding("e", "edit", "edit"),
        Binding("escape", "leave", "leave the editor", show=False),
        Binding("comma", "turn(-1)", "other", key_display=", ."),
        Binding("full_stop", "turn(1)", "next", show=False),
        Binding("n", "new", "new"),
        Binding("x", "remove", "remove", show=False),
        Binding("o", "open", "open a file", show=False),
        Binding("s", "write", "write a file", show=False),
        Binding("b", "bus", "bus"),
    ]

    def __init__(self, session: Session) -> None:
        self.runner = sequence_task.SequenceTask(session.model.eds)
        super().__init__(session, self.runner)
        self.texts, self.number = [sequence_task.NEW], 0
        self._steps: list[str] = []
        self._events: list[SequenceEvent] = []
        self._going = False

    def compose(self) -> ComposeResult:
        """Lay out what happens and the editor."""
        yield TitleLine("state")
        with Horizontal():
            yield LineView()
            yield TextArea(self.texts[self.number], tab_behavior="focus", show_line_numbers=True)
        yield Static(id="mistake", markup=False)
        yield PromptLine()

    def snapshot(self, model: Model) -> None:
        """Keep what happened."""
        self._events, self._going = list(self.runner.events), self.runner.running

    def paint(self) -> None:
        """Show it, the latest in view; or the steps."""
        self.query_one("#state", TitleLine).show(self._state())
        view = self.query_one(LineView)
        follows = view.follows
        lines = [plain(line) for line in self._steps] or list(map(_line, self._events))
        view.show(lines or [plain("F5 runs it, F7 shows its steps")])
        if follows:
            view.show_end()

    def load(self, settings: Mapping[str, Any]) -> None:
        """Take the bus and the sequences."""
        super().load(settings)
        self.texts = sequence_task.read_texts(settings) or [sequence_task.NEW]

    def save(self) -> dict[str, Any]:
        """Return them."""
        return {"bus": self.runner.channel, "item": sequence_task.texts_settings(self.texts)}

    def on_text_area_changed(self, event: TextArea.Changed) -> None:
        """Keep what is written."""
        self.texts[self.number] = event.text_area.text

    def action_run(self) -> None:
        """Carry out the sequence of the editor."""
        sequence = self._read()
        if sequence is not None and self.may_send():
            self._steps = []
            self.change(lambda: self.runner.start(sequence))

    def action_steps(self) -> None:
        """Show the steps; nothing is sent."""
        sequence = self._read()
        if sequence is not None:
            self._steps = outline(sequence.steps)
            self.refresh_view()

    def action_edit(self) -> None:
        """Go to the editor."""
        self.query_one(TextArea).focus()

    def action_leave(self) -> None:
        """Leave the editor."""
        self.query_one(LineView).focus()

    def action_turn(self, steps: int) -> None:
        """Edit another sequence."""
        self._open((self.number + steps) % len(self.texts))

    def action_new(self) -> None:
        """Begin a new sequence."""
        self.texts.append(sequence_task.NEW)
        self._open(len(self.texts) - 1)

    def action_remove(self) -> None:
        """Forget the sequence of the editor."""
        del self.texts[self.number]
        self.texts = self.texts or [sequence_task.NEW]
        self._open(min(self.number, len(self.texts) - 1))

    def action_open(self) -> None:
        """Ask for a file, and read a sequence from it."""
        self.query_one(PromptLine).prompt("read a sequence from file", "", self._read_file)

    def action_write(self) -> None:
        """Ask for a file, and write the sequence to it."""
        name = f"{self._called()}.toml"
        self.query_one(PromptLine).prompt("write the sequence to file", name, self._write_file)

    def _read(self) -> Sequence | None:
        """Return the sequence of the editor; say what is wrong with it, and go there."""
        wrong, area = self.query_one("#mistake", Static), self.query_one(TextArea)
        try:
            sequence = self.runner.parse(area.text, self._called())
        except StepError as error:
            wrong.update(str(error))
            wrong.display = True
            place = _PLACE.match(str(error))
            area.move_cursor((int(place[1]) - 1 if place else 0, 0))
            return None
        wrong.display = False
        return sequence

    def _open(self, number: int) -> None:
        self.number, self._steps = number, []
        self.query_one(TextArea).text = self.texts[number]
        self.refresh_view()

    def _read_file(self, text: str) -> None:
        try:
            found = Path(text).read_text("utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise ValueError(f"{text}: {getattr(error, 'strerror', '') or 'is no text'}") from None
        self.texts.append(found)
        self._open(len(self.texts) - 1)

    def _write_file(self, text: str) -> None:
        try:
            write_whole(Path(text), self.texts[self.number])
        except OSError as error:
            raise ValueError(f"{text}: {error.strerror}") from None
        self.notify(f"{text} is written", markup=False)

    def _called(self) -> str:
        return sequence_task.sequence_name(self.texts[self.number], self.number + 1)

    def _state(self) -> str:
        words = [f"{self._called()} ({self.number + 1} of {len(self.texts)})"]
        words += [f"bus {self.runner.channel}"] * bool(self.runner.channel)
        words += ["runs"] * self._going
        return "   ".join(words)


def _line(event: SequenceEvent) -> Line:
    return plain(event_line(event), _STYLES.get(event.mark, ""))
