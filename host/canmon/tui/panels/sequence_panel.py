"""The tab of the sequences, with an editor and the events of a running sequence.

>>> sequence_name('name = "start"', 1), sequence_name("# sync" + chr(10) + "+10 080#", 2)
('start', 'sync')
>>> sequence_name("", 3)
'sequence 3'
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.widgets import Static, TextArea

from tickrig.host.canmon.model.decode.node_memory import EdsObjects
from tickrig.host.canmon.model.sequence import (
    DecodedCondition,
    EventType,
    SequenceEvent,
    SequenceRun,
    TomlSequence,
    event_line,
    outline,
    parse_lines,
)
from tickrig.host.canmon.model.sequence import Sequence as Steps
from tickrig.host.canmon.model.transmit import PdoFrames
from tickrig.host.canmon.tui.panels.panel import PromptLine, SendingPanel, TitleLine, read_help
from tickrig.host.canmon.tui.session import DecodedFrame, Model, Session, Task
from tickrig.host.canmon.workspace import below, tables, text_of
from tickrig.host.text.steps import StepError
from tickrig.host.text.whole_file import write_whole
from tickrig.host.tui import Line, LineView, plain
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER

# A sequence that is carried out on a session.


NEW: Final = """\
name = "new"

[[step]]
send = "080#"

[[step]]
wait = "100ms"
"""
"""Initial text of a new sequence."""

_NAME: Final = re.compile(r"""\s*(?:name\s*=\s*["'](.+?)["']|#\s*(.+?))\s*""")


def sequence_name(text: str, number: int) -> str:
    """Return the name of a sequence for display.

    The first line of the text gives the name, as a value of `name` or as a comment. If the first
    line has no name, the name is made from `number`.
    """
    match = _NAME.fullmatch(text.partition("\n")[0])
    return (match[1] or match[2]) if match else f"sequence {number}"


def _read_texts(settings: Mapping[str, Any]) -> list[str]:
    """Return the texts of `[[item]]`. Raise SettingError if one is not a text."""
    texts = []
    for number, item in enumerate(tables(settings, "item")):
        with below("item", number):
            texts.append(text_of(item, "text", ""))
    return texts


def texts_settings(texts: list[str]) -> list[dict[str, Any]]:
    """Return texts as settings. Each text keeps its lines."""
    import tomlkit  # noqa: PLC0415 - an extra
    from tomlkit.exceptions import InvalidStringError  # noqa: PLC0415

    def written(text: str) -> Any:
        text = text.lstrip("\n")  # TOML drops the first one
        if "\r" in text:  # tomlkit up to 0.15.0 writes it as it is, and cannot read it
            return text
        try:
            return tomlkit.string(text, literal=True, multiline=True)
        except InvalidStringError:
            return text

    return [{"text": written(text)} for text in texts]


_KEPT: Final = 1_000
"""Number of events that are kept."""

_LINES: Final = ("+", "loop")
"""Beginnings of a sequence of plain lines. Other sequences are TOML."""


class SequenceTask(Task):
    """Task that executes the sequences of the monitor, one sequence at a time.

    Args:
        eds: content of EDS files by node-ID.
        channel: name of the bus on which the task sends, empty for the first bus.

    Attributes:
        events: events of the present execution, oldest first. The times of the events count from
            the beginning of the execution.
    """

    def __init__(self, eds: Mapping[int, EdsObjects], channel: str = "") -> None:
        self.channel = channel
        self.events: deque[SequenceEvent] = deque(maxlen=_KEPT)
        self._pdos, self._decoded = PdoFrames(eds), DecodedCondition()
        self._run: SequenceRun | None = None
        self._begin_us: int | None = None

    @property
    def running(self) -> bool:
        """Whether a sequence is running."""
        return self._run is not None

    @property
    def due_us(self) -> int:
        """Time at which the next call is due, even if no frame arrives."""
        return NEVER if self._run is None else self._run.due_us

    def parse(self, text: str, name: str) -> Steps:
        """Read a sequence of plain lines or TOML. Raise StepError if it is invalid."""
        lines = (line.strip() for line in text.splitlines())
        begin = next((line for line in lines if line and not line.startswith("#")), "")
        if begin.startswith(_LINES):
            return parse_lines(text, name)
        resolve, condition = self._pdos.frame, self._decoded.condition
        return TomlSequence(text, name, resolve=resolve, condition=condition).parse()

    def start(self, sequence: Steps) -> None:
        """Start a sequence at the next call. The new sequence replaces a running sequence."""
        self.events.clear()
        self._begin_us, self._run = None, SequenceRun(sequence)

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
        """Process records. Return the frames that the sequence sends."""
        run = self._run
        if run is None:
            return ()
        if self._begin_us is None:
            self._begin_us = now_us
        out = list(run.tick(now_us))
        for one, decoded in records:
            self._decoded.take(one, decoded)
            out += run.tick(now_us, (one,))
        begin_us = self._begin_us
        self.events += (event._replace(at_us=event.at_us - begin_us) for event in run.events)
        run.events.clear()
        if run.done:
            self._run = None
        return tuple(out)

    def stop(self) -> None:
        """Stop the sequence."""
        if self._run is not None:
            self._run = None
            at_us = self.events[-1].at_us if self.events else 0
            self.events.append(SequenceEvent(at_us, EventType.END, "stopped"))


_STYLES: Final = {EventType.MET: "green", EventType.MISSED: "bold red", EventType.END: "bold"}
_PLACE: Final = re.compile(r".*?:([0-9]+): ")


class SequencePanel(SendingPanel):
    """A list of sequences, one of which is in the editor."""

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
        self.runner = SequenceTask(session.model.eds)
        super().__init__(session, self.runner)
        self.texts, self.number = [NEW], 0
        self._steps: list[str] = []
        self._events: list[SequenceEvent] = []
        self._going = False

    def compose(self) -> ComposeResult:
        """Lay out the events and the editor."""
        yield TitleLine("state")
        with Horizontal():
            yield LineView()
            yield TextArea(self.texts[self.number], tab_behavior="focus", show_line_numbers=True)
        yield Static(id="mistake", markup=False)
        yield PromptLine()

    def snapshot(self, model: Model) -> None:
        """Copy the events."""
        self._events, self._going = list(self.runner.events), self.runner.running

    def paint(self) -> None:
        """Show the events with the latest in view, or show the steps."""
        self.query_one("#state", TitleLine).show(self._state())
        view = self.query_one(LineView)
        follows = view.follows
        lines = [plain(line) for line in self._steps] or list(map(_line, self._events))
        view.show(lines or [plain("F5 runs it, F7 shows its steps")])
        if follows:
            view.show_end()

    def load(self, settings: Mapping[str, Any]) -> None:
        """Load the bus and the sequences."""
        super().load(settings)
        self.texts = _read_texts(settings) or [NEW]

    def save(self) -> dict[str, Any]:
        """Return the bus and the sequences."""
        return {"bus": self.runner.channel, "item": texts_settings(self.texts)}

    def on_text_area_changed(self, event: TextArea.Changed) -> None:
        """Store the edited text."""
        self.texts[self.number] = event.text_area.text

    def action_run(self) -> None:
        """Run the sequence of the editor."""
        sequence = self._read()
        if sequence is not None and self.may_send():
            self._steps = []
            self.change(lambda: self.runner.start(sequence))

    def action_steps(self) -> None:
        """Show the steps. Nothing is sent."""
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
        self.texts.append(NEW)
        self._open(len(self.texts) - 1)

    def action_remove(self) -> None:
        """Remove the sequence of the editor."""
        del self.texts[self.number]
        self.texts = self.texts or [NEW]
        self._open(min(self.number, len(self.texts) - 1))

    def action_open(self) -> None:
        """Ask for a file, and read a sequence from it."""
        self.query_one(PromptLine).prompt("read a sequence from file", "", self._read_file)

    def action_write(self) -> None:
        """Ask for a file, and write the sequence to it."""
        name = f"{self._called()}.toml"
        self.query_one(PromptLine).prompt("write the sequence to file", name, self._write_file)

    def _read(self) -> Steps | None:
        """Return the sequence of the editor.

        If the sequence is invalid, report the error and go to the place of the error.
        """
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
        return sequence_name(self.texts[self.number], self.number + 1)

    def _state(self) -> str:
        words = [f"{self._called()} ({self.number + 1} of {len(self.texts)})"]
        words += [f"bus {self.runner.channel}"] * bool(self.runner.channel)
        words += ["runs"] * self._going
        return "   ".join(words)


def _line(event: SequenceEvent) -> Line:
    return plain(event_line(event), _STYLES.get(event.mark, ""))
