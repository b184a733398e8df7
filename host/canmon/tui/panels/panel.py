"""The base class of all tabs of the monitor, and the list of built-in and installed tabs."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.events import Click
from textual.message import Message
from textual.widget import Widget
from textual.widgets import Input, Static

from tickrig.host.canmon.model.frames import AnyRecord
from tickrig.host.canmon.tui.session import Model, Session, Task
from tickrig.host.canmon.workspace import checked_bus
from tickrig.host.cli.extensions import ExtensionGroup
from tickrig.host.text.user_file import explain_error
from tickrig.host.tui import Line, LineView

# Small widgets of which panels are made: a title, a list, a question, a picture.


class TitleLine(Static):
    """A line that shows a text.

    Args:
        name: id of the widget.
    """

    DEFAULT_CSS = "TitleLine { height: 1; }"

    def __init__(self, name: str) -> None:
        super().__init__(id=name, markup=False)

    def show(self, text: str) -> None:
        """Show another text, without a new layout."""
        if self.content != text:
            self.update(text, layout=False)


_CHOSEN: Final = "reverse"


class ChoiceView(LineView):
    """A list in a panel in which the user chooses a line.

    The chosen line is shown in reverse video.

    Attributes:
        chosen: number of the chosen line, from 0.
    """

    class Chosen(Message):
        """Message that a line was chosen."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "choose(-1)", "up", show=False),
        Binding("down", "choose(1)", "down", show=False),
        Binding("pageup", "choose_page(-1)", "page up", show=False),
        Binding("pagedown", "choose_page(1)", "page down", show=False),
        Binding("home", "choose_end(False)", "first", show=False),
        Binding("end", "choose_end(True)", "last", show=False),
    ]

    def __init__(self, id: str | None = None) -> None:  # noqa: A002 - Textual's name
        super().__init__(id=id)
        self.chosen = 0
        self._rows: list[Line] = []

    def show(self, lines: Sequence[Line], begin: int = 0, total: int | None = None) -> None:
        """Show all lines of the list. `begin` and `total` have no effect."""
        self._rows = list(lines)
        self.chosen = min(self.chosen, max(0, len(lines) - 1))
        marked = [
            tuple((text, f"{style} {_CHOSEN}".strip()) for text, style in line)
            if number == self.chosen
            else line
            for number, line in enumerate(lines)
        ]
        super().show(marked)

    def choose(self, number: int) -> None:
        """Choose a line, and scroll it into view."""
        self.chosen = min(max(0, number), max(0, len(self._rows) - 1))
        self.show(self._rows)
        if not self.top <= self.chosen < self.top + self.rows:
            top = self.chosen if self.chosen < self.top else self.chosen - self.rows + 1
            self.scroll_to(y=top, animate=False, immediate=True, force=True)
        self.post_message(self.Chosen())

    def action_choose(self, steps: int) -> None:
        """Choose a line that is further down or up."""
        self.choose(self.chosen + steps)

    def action_choose_page(self, pages: int) -> None:
        """Choose a line that is a screen further."""
        self.choose(self.chosen + pages * max(1, self.rows))

    def action_choose_end(self, last: bool) -> None:
        """Choose the first or the last line."""
        self.choose(len(self._rows) if last else 0)

    def on_click(self, event: Click) -> None:
        """Choose the line under the mouse."""
        self.choose(self.top + event.y)


_Take = Callable[[str], None]
"""Function that takes an answer. It raises ValueError if the answer is wrong."""


class PromptLine(Vertical):
    """A prompt, hidden until a question is asked. Enter submits the answer, Escape leaves."""

    DEFAULT_CSS = """
    PromptLine { display: none; height: auto; }
    PromptLine Static { height: auto; }
    PromptLine #wrong { display: none; color: $error; }
    PromptLine Input { height: 1; border: none; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "leave", "leave", show=False)]

    def __init__(self) -> None:
        super().__init__(id="ask")
        self._take: _Take | None = None
        self._back: Widget | None = None

    def compose(self) -> ComposeResult:
        """Lay out question, answer and error message."""
        yield Static(id="question", markup=False)
        yield Input(id="answer", compact=True)
        yield Static(id="wrong", markup=False)

    def prompt(self, question: str, answer: str, take: _Take) -> None:
        """Ask the user for a text, in a line of the panel.

        Args:
            question: text of the question.
            answer: default answer, which the user can edit.
            take: function that is called with the answer of the user.
        """
        if not self.display:
            self._back = self.screen.focused
        self._take, self.display = take, True
        self.query_one("#question", Static).update(question)
        self.query_one("#wrong").display = False
        field = self.query_one("#answer", Input)
        field.value = answer
        field.focus()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Pass on the answer. Show an error if the answer is wrong."""
        event.stop()
        assert self._take is not None, "something was asked"
        try:
            self._take(event.value.strip())
        except ValueError as error:
            wrong = self.query_one("#wrong", Static)
            wrong.update(str(error))
            wrong.display = True
            return
        self.action_leave()

    def action_leave(self) -> None:
        """Close the prompt."""
        self.display = False
        if self._back is not None:
            self._back.focus()


class PictureView(LineView, inherit_bindings=False):
    """A widget that shows a picture made of characters, such as the curves of the graph panel.

    The widget does not handle any keys, so that the panel around it receives all of them.
    """

    class Pointed(Message):
        """Message that the picture was clicked.

        Attributes:
            x: column of the click in characters.
        """

        def __init__(self, x: int) -> None:
            super().__init__()
            self.x = x

    def on_click(self, event: Click) -> None:
        """Report the position of the click."""
        self.post_message(self.Pointed(event.x))


_CODE: Final = re.compile("\x1b\\[([0-9]*)m")


def ansi_line(text: str, styles: Mapping[str, str]) -> Line:
    r"""Convert a text with ANSI codes to a line with styles. The line does not contain the codes.

    Each code sets the style of the text between this code and the next code.

    Args:
        text: text with ANSI codes.
        styles: style for each code. Other codes set no style.

    >>> ansi_line("01 \x1b[7mFF\x1b[0m", {"7": "bold yellow"})
    (('01 ', ''), ('FF', 'bold yellow'))
    """
    pieces = _CODE.split(text)
    codes = ("", *pieces[1::2])
    found = zip(pieces[::2], codes, strict=True)
    return tuple((part, styles.get(code, "")) for part, code in found if part)


# The base class of tabs, which is the contract between the app and its panels.


def read_help(module: str) -> str:
    """Return the help text of a tab, which is a Markdown file beside the module of the tab."""
    return Path(module).with_suffix(".md").read_text("utf-8")


class FrameWanted(Message):
    """A Textual message with which a panel asks the app to show a frame in the trace tab.

    Args:
        at_us: time of the frame in microseconds.
        record: frame to show, or None for the latest frame up to `at_us`.
    """

    def __init__(self, at_us: int, record: AnyRecord | None) -> None:
        super().__init__()
        self.at_us, self.record = at_us, record


class Panel(Vertical):
    """Base class of the tabs of the monitor `canmon tui`.

    While the panel is visible, the app calls `refresh_view` ten times a second. The panel may also
    call it after a key. A subclass defines its keys as Textual `BINDINGS`, each with a description,
    and its help `HELP` in Markdown. F1 shows the keys and the help.

    A panel that needs every frame, or sends frames, adds a `Task` to `session.tasks` when it is
    created.

    Args:
        session: session with the traffic and the buses to send on.

    Attributes:
        title: title of the tab.
        section: name of the panel's table in the workspace, which is also the id of its widget.
        session: session with the traffic and the buses to send on.
    """

    title: ClassVar[str] = ""
    section: ClassVar[str] = ""

    def __init__(self, session: Session) -> None:
        super().__init__(id=self.section)
        self.session = session

    def enter(self) -> None:
        """Take the keyboard focus when the panel becomes visible."""
        for widget in (*self.query(LineView), *self.query("*")):
            if widget.focusable:
                widget.focus()
                return

    def refresh_view(self) -> None:
        """Take a snapshot of the model, and show it."""
        with self.session.lock:
            self.snapshot(self.session.model)
        self.paint()

    def change(self, act: Callable[[], object]) -> None:
        """Change the model or a task, and show the result."""
        with self.session.lock:
            act()
        self.refresh_view()

    def may_send(self) -> bool:
        """Return whether frames may be sent. If not, show the reason to the user."""
        if not self.session.armed:
            self.notify("not armed: nothing is sent; A arms", markup=False)
        return self.session.armed

    def snapshot(self, model: Model) -> None:
        """Copy the data to show from the model. The session waits, so be quick."""

    def paint(self) -> None:
        """Show the data of the snapshot while the panel is visible."""

    def load(self, settings: Mapping[str, Any]) -> None:
        """Apply the settings of the panel from the workspace file, before the panel is on a screen.

        The method ignores unknown keys, which stay in the file.

        Raises:
            SettingError: a value is invalid. The message names the value.
        """

    def save(self) -> dict[str, Any]:
        """Return the settings of the panel as TOML values, for the workspace file.

        TOML values are tables, arrays, strings, numbers and booleans. The app also calls this
        method while the panel is not on a screen, so the method must not read values from widgets.
        """
        return {}


class SendingPanel(Panel):
    """Base class of tabs that send frames on a bus. The user selects the bus.

    Args:
        session: session with the traffic and the buses to send on.
        sender: task that sends the frames.
    """

    def __init__(self, session: Session, sender: Task) -> None:
        super().__init__(session)
        self._sender = sender
        session.tasks.append(sender)

    def load(self, settings: Mapping[str, Any]) -> None:
        """Load the bus."""
        self._sender.channel = checked_bus(self.session.buses, settings)

    def action_stop(self) -> None:
        """Stop sending."""
        self.change(self._sender.stop)

    def action_bus(self) -> None:
        """Send on the next bus from now on."""
        self.change(self._take_next_bus)

    def _take_next_bus(self) -> None:
        self._sender.stop()
        self._sender.channel = self.session.next_bus(self._sender.channel)


# The tabs of `canmon tui`: ours in their order, then those of installed packages.

_HERE: Final = "tickrig.host.canmon.tui.panels"
TABS: Final = ExtensionGroup[type[Panel]](
    "tickrig.tabs",
    "tab",
    {
        "trace": f"{_HERE}.trace_panel:TracePanel",
        "nodes_view": f"{_HERE}.nodes_panel:NodesPanel",
        "statistics": f"{_HERE}.statistics_panel:StatisticsPanel",
        "objects": f"{_HERE}.dictionary_panel:DictionaryPanel",
        "transmit": f"{_HERE}.transmit_panel:TransmitPanel",
        "sequence": f"{_HERE}.sequence_panel:SequencePanel",
        "graph": f"{_HERE}.graph_panel:GraphPanel",
        "alarms": f"{_HERE}.alarms_panel:AlarmsPanel",
    },
    lambda found: isinstance(found, type) and issubclass(found, Panel) and bool(found.title),
    "a Panel with a title",
)
"""Tabs by their sections in a workspace. Key 1 shows the first tab, and so on."""


def make_panels(session: Session, notify: Callable[[str], None]) -> list[Panel]:
    """Create the tabs of the monitor, including tabs of other installed packages.

    A tab of another package that cannot be created is left out.

    Args:
        session: session that the tabs show.
        notify: function that is called with a line of text about each tab that is left out.
    """
    return list(_panels(session, notify))


def _panels(session: Session, notify: Callable[[str], None]) -> Iterator[Panel]:
    for name, tab in TABS.load_all(notify).items():
        tasks = list(session.tasks)
        try:
            panel = tab(session)
            if panel.section != name:
                raise ValueError(f"its section is {panel.section!r}")
        except Exception as error:
            if name in TABS.built_in:
                raise
            session.tasks[:] = tasks
            notify(f"tab {name!r}: {explain_error(error)}")
            continue
        yield panel
