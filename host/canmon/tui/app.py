"""The monitor: tabs of panels over one session."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Final

import click
from rich.segment import Segment
from rich.style import Style
from textual.app import ComposeResult, SystemCommand
from textual.binding import Binding, BindingType
from textual.events import Click
from textual.screen import ModalScreen, Screen
from textual.strip import Strip
from textual.widget import Widget
from textual.widgets import Input, TabbedContent, TabPane

from tickrig.host.canmon import workspace
from tickrig.host.canmon.model.frames import load_text
from tickrig.host.canmon.model.recorder.recorder import Recorder, RecorderState
from tickrig.host.canmon.output.recording import WORDS_METAVAR, read_recording
from tickrig.host.canmon.tui.panels.panel import Panel
from tickrig.host.canmon.tui.session import DecodedFrame, Session, Task
from tickrig.host.cli.messages import Refused, SourceFailed
from tickrig.host.text.values import counted
from tickrig.host.tui import FramedApp, KeyFooter, Line
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER

# A task that records what the session hears, while somebody wants it.

_LOOK_US: Final = 100_000
"""How often it is called while no frame comes."""

_WORDS: Final = "run.log"

_Light = tuple[str, str]
"""A text and its style."""


class RecorderTask(Task):
    """Records in parts, so that no file of before is overwritten.

    Args:
        session: what is heard.

    Attributes:
        section: its table in the workspace.
        words: what is recorded, as behind `canmon dump -l`.
        recorder: what records, or did last; None before the first.
    """

    section: Final = "record"

    def __init__(self, session: Session) -> None:
        self._session = session
        self.words = _WORDS
        self.recorder: Recorder | None = None
        self._due_us = NEVER
        session.tasks.append(self)

    @property
    def due_us(self) -> int:
        """When it is next called without a frame."""
        return self._due_us

    @property
    def running(self) -> bool:
        """Whether it records, or waits for a trigger."""
        recorder = self.recorder
        return recorder is not None and recorder.state in (
            RecorderState.WAITING,
            RecorderState.RECORDING,
        )

    @property
    def failed(self) -> str:
        """Why the latest recording ended before its time; empty if it did not."""
        return "" if self.recorder is None else self.recorder.failed

    def start(self, words: str) -> None:
        """Begin a recording; buses that go away are opened again from now on.

        Raises:
            ValueError: words that name none, or it cannot be written there.
        """
        session = self._session
        self.end()
        try:
            recording = read_recording(words, session.model.top.view.bit_rate)
            with session.lock:
                model = session.model
                self.recorder = Recorder(
                    recording.plan, model.now_us, recording.triggers, lost=session.source.lost
                )
                self._due_us = session.now_us
                session.marks.clear()
        except Refused as error:
            raise ValueError(error.message) from None
        except OSError as error:
            raise ValueError(f"{error.filename}: {error.strerror}") from None
        self.words = words
        session.source.reopen()

    def end(self) -> list[str]:
        """End the recording; say how it went."""
        with self._session.lock:
            self._due_us = NEVER
            if self.recorder is None:
                return []
            self.recorder.close()
            return self.recorder.messages()

    def trigger(self) -> None:
        """Record what was kept and what comes."""
        with self._session.lock:
            if self.recorder is not None:
                self.recorder.trigger("key", self._session.model.now_us)

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
        """Record; it sends nothing."""
        session, recorder = self._session, self.recorder
        if recorder is not None and self._due_us != NEVER:
            self._due_us = now_us + _LOOK_US
            marks = [session.marks.popleft() for _ in range(len(session.marks))]
            recorder.take(records, session.source.lost, session.model.now_us, marks)
        return ()

    def light(self) -> list[_Light]:
        """Return what the line at the bottom says of it."""
        recorder = self.recorder
        if recorder is None or (self._due_us == NEVER and not recorder.failed):
            return []
        said = counted(recorder.frames, "frame")
        match recorder.state:
            case RecorderState.RECORDING:
                return [(" REC ", "bold white on red"), (f" {said} ", "")]
            case RecorderState.WAITING:
                return [(" REC WAITS ", "bold black on yellow"), (f" {said} ", "")]
            case RecorderState.FAILED:
                text = f" REC FAILED: {recorder.failed}; {recorder.missing} frames missing "
                return [(text, "bold red")]
            case RecorderState.ENDED:
                return [(f" REC ENDED: {recorder.ended} ", "bold yellow")]

    def load(self, settings: Mapping[str, Any]) -> None:
        """Take what was recorded last; SettingError if it is none."""
        self.words = workspace.text_of(settings, "words", self.words)

    def save(self) -> dict[str, Any]:
        """Return what was recorded last."""
        return {"words": self.words}


# The line at the bottom: how the bus is, what got lost, and whether frames may be sent.

ARMED: Final = (" ARMED ", "bold white on red")
_LISTENING: Final = (" LISTEN-ONLY ", "bold black on green")
_WARNING: Final = "bold yellow"
_ALARM: Final = "bold red"


class StatusLine(Widget):
    """Shows a status; a click on its first word arms or disarms.

    Args:
        session: what it is about.
        recorder: what records.
    """

    DEFAULT_CSS = "StatusLine { height: 1; background: $boost; }"

    def __init__(self, session: Session, recorder: RecorderTask) -> None:
        super().__init__(id="status")
        self._session, self._recorder = session, recorder
        self._counts = [0]
        self.line: Line = ()

    def refresh_view(self) -> None:
        """Show how things are now; called ten times a second."""
        with self._session.lock:
            line = self._status()
        if line != self.line:
            self.line = line
            self.refresh()

    def _status(self) -> Line:
        """Return the line: who may send, the buses, counts, what is wrong."""
        session, model = self._session, self._session.model
        self._counts = [*self._counts[-10:], model.frames]
        line = [ARMED if session.armed else _LISTENING, *self._recorder.light()]
        for bus in model.top.traffic.buses(model.now_us):
            load = load_text(bus.load.latest.bits, model.top.view.bit_rate)
            line.append((f" {bus.channel} {load}", ""))
            if bus.errors.state is not None:
                state = bus.errors.state.name.lower().replace("_", "-")
                line.append((f" {state}", "" if state == "active" else _ALARM))
            line += [(f" {bus.errors.frames} error frames", _WARNING)] if bus.errors.frames else []
        line.append((f"  {model.frames} frames  {model.frames - self._counts[0]}/s", ""))
        line.append((f"  lost {model.lost}", _ALARM if model.lost else ""))
        line += [(f"  passed over {model.unread}", _ALARM)] if model.unread else []
        line += [(f"  sent {session.sent}", "")] if session.sent else []
        line += [(f"  {', '.join(model.away)} is gone", _ALARM)] if model.away else []
        trouble = session.trouble or model.failed
        line += [(f"  {trouble}", _ALARM)] if trouble else []
        line += [("  end of the log", "")] if model.ended and not trouble else []
        return tuple(line)

    def render_line(self, y: int) -> Strip:
        """Return the line for the screen."""
        strip = Strip([Segment(text, Style.parse(style)) for text, style in self.line])
        return strip.crop_extend(0, self.size.width, None).apply_style(self.rich_style)

    async def on_click(self, event: Click) -> None:
        """Arm or disarm."""
        if self.line and event.x < len(self.line[0][0]):
            await self.app.run_action("arm")


class _ExportScreen(ModalScreen[str]):
    """A field for the name of a file; Escape leaves without one.

    Args:
        name: what stands in the field.
        title: what it is for.
        example: what is shown in an empty one.
    """

    DEFAULT_CSS = """
    ExportScreen { align: center middle; }
    ExportScreen Input { width: 60; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "leave", "leave")]

    def __init__(
        self, name: str, title: str = "keep all settings in", example: str = "bench.toml"
    ) -> None:
        super().__init__()
        self._text, self._title, self._example = name, title, example

    def compose(self) -> ComposeResult:
        """Lay out the field."""
        field = Input(self._text, placeholder=self._example)
        field.border_title = self._title
        yield field

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Take the name."""
        self.dismiss(event.value.strip())

    def action_leave(self) -> None:
        """Take none."""
        self.dismiss("")


_PAINT_S: Final = 0.1
_SAVE_S: Final = 2.0
_SWITCH_S: Final = 0.002
"""How long the screen may keep the session from running."""


class MonitorApp(FramedApp):
    """Tabs, keys, help and the status line.

    Args:
        session: what is heard, and how to send; it is started by whoever runs the app.
        panels: the tabs.
        panel_settings: keeps their settings; without one nothing is kept until it is exported.
        recorder: what records; a new one unless given.
    """

    TITLE = "canmon"
    CSS = """
    TabbedContent, ContentSwitcher, TabPane, Panel { height: 1fr; }
    TabPane { padding: 0; }
    ContentTab { padding: 0 1 0 0; }
    TabbedContent, ContentSwitcher, TabPane { visibility: hidden; }
    ContentTabs, Panel { visibility: visible; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("A", "arm", "arm"),
        Binding("f9", "stop", "stop all", priority=True, key_display="F9"),
        *[Binding(f"{n}", f"tab({n})", f"tab {n}", show=False) for n in range(1, 10)],
        Binding("w", "export", "save as"),
        Binding("f8", "record", "record", key_display="F8"),
        Binding("f4", "trigger", "trigger", key_display="F4"),
    ]

    def __init__(
        self,
        session: Session,
        panels: Sequence[Panel],
        panel_settings: workspace.PanelSettings | None = None,
        recorder: RecorderTask | None = None,
    ) -> None:
        super().__init__()
        self.recorder = recorder or RecorderTask(session)
        self.animation_level = "none"  # each picture goes over a line that may be slow
        self.session, self.panels = session, tuple(panels)
        self.panel_settings = panel_settings or workspace.PanelSettings(
            workspace.Workspace(), workspace.MonitorSetup(), [*panels, self.recorder]
        )

    def compose(self) -> ComposeResult:
        """Lay out the tabs."""
        with TabbedContent(initial=_tab(self.panels[0])):
            for number, panel in enumerate(self.panels, 1):
                with TabPane(f"{number} {panel.title}", id=_tab(panel)):
                    yield panel
        yield StatusLine(self.session, self.recorder)
        yield KeyFooter()

    def on_mount(self) -> None:
        """Begin to paint."""
        self.set_interval(_PAINT_S, self.refresh_view)
        self.set_interval(_SAVE_S, self.save)
        if unknown := self.panel_settings.unknown():
            self.notify(f"not known here, and kept: {', '.join(unknown)}", severity="warning")

    def run_session(self) -> None:
        """Read the source in a thread and show the panels until they are left."""
        before_s, said = sys.getswitchinterval(), []
        sys.setswitchinterval(_SWITCH_S)
        with self.ended_by_signals():
            self.session.start()
            try:
                self.run()
            finally:
                self.session.close()
                said += self.recorder.end()
                if trouble := self.panel_settings.save():
                    said.append(trouble)
                sys.setswitchinterval(before_s)
        self.session.check()
        for word in said:
            click.echo(word, err=True)
        if self.return_code:
            raise SystemExit(self.return_code)
        if self.recorder.failed:
            raise SourceFailed(self.recorder.failed)

    def end(self) -> None:
        """Send nothing more at once, then end the app."""
        self.session.armed = False
        super().end()

    def save(self) -> None:
        """Keep the settings."""
        if trouble := self.panel_settings.save():
            self.notify(trouble, severity="error", timeout=10)

    @property
    def shown(self) -> Panel:
        """The panel that is on the screen."""
        active = self.query_one(TabbedContent).active
        return next(panel for panel in self.panels if _tab(panel) == active)

    def refresh_view(self) -> None:
        """Paint what is on the screen."""
        self.session.check()
        if self.screen_stack and self.query(StatusLine):
            self.shown.refresh_view()
            self.query_one(StatusLine).refresh_view()

    def on_tabbed_content_tab_activated(self) -> None:
        """Let the keys go to the panel, and paint it at once."""
        if not self.shown.query("*:focus"):
            self.shown.enter()
        self.refresh_view()

    def action_tab(self, number: int) -> None:
        """Show a tab."""
        if number <= len(self.panels):
            self.query_one(TabbedContent).active = _tab(self.panels[number - 1])

    def action_arm(self) -> None:
        """Let panels send, or stop them."""
        if self.session.armed:
            self.session.disarm()
        elif self.session.can_send:
            self.session.arm()
        else:
            self.notify("nothing is sent into a log", severity="warning")

    def action_export(self) -> None:
        """Ask for a file and keep the settings there."""
        path = self.panel_settings.workspace.path
        self.push_screen(_ExportScreen("" if path is None else str(path)), self._export)

    def _export(self, name: str | None) -> None:
        if name:
            try:
                self.panel_settings.export(Path(name))
            except workspace.WorkspaceError as error:
                self.notify(str(error), severity="error")
                return
            self.notify(f"settings are kept in {name}")

    def action_record(self) -> None:
        """Ask what to record, or end the recording."""
        if self.recorder.running:
            self.notify("\n".join(self.recorder.end()), markup=False)
        elif not self.session.source.live:
            self.notify("all of a log is there: canmon conv writes it into another")
        else:
            screen = _ExportScreen(self.recorder.words, "record into", WORDS_METAVAR)
            self.push_screen(screen, self._record)

    def _record(self, words: str | None) -> None:
        if words:
            try:
                self.recorder.start(words)
            except ValueError as error:
                self.notify(str(error), severity="error", markup=False)

    def action_trigger(self) -> None:
        """Record what was kept and what comes."""
        if not self.recorder.running:
            self.notify("nothing waits for a trigger: F8 records, as run.log --pre 5s")
        self.recorder.trigger()

    def get_system_commands(self, screen: Screen[object]) -> Iterable[SystemCommand]:
        """Offer the tabs, and the keys of the frame and of the panel on the screen, by name."""
        yield from super().get_system_commands(screen)
        for number, panel in enumerate(self.panels, 1):
            yield SystemCommand(panel.title, f"show tab {number}", partial(self.action_tab, number))
        for owner in (self, self.shown):
            for _, binding in owner._bindings:
                if binding.show:
                    run = partial(self.run_action, binding.action, owner)
                    yield SystemCommand(binding.description, f"key {binding.key}", run)

    def action_stop(self) -> None:
        """Stop all that sends, at once."""
        self.session.disarm()


def _tab(panel: Panel) -> str:
    return f"tab-{panel.section}"
