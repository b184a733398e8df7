"""The monitor, with tabs of panels that share one session."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final, NamedTuple, TypeVar

import click
from rich.segment import Segment
from rich.style import Style
from textual.app import ComposeResult, SystemCommand
from textual.binding import Binding, BindingType
from textual.compose import compose
from textual.events import Click
from textual.screen import ModalScreen, Screen
from textual.strip import Strip
from textual.widget import Widget
from textual.widgets import Input, TabbedContent, TabPane

from tickrig._lazy import LazyModule
from tickrig.host.canmon import workspace
from tickrig.host.canmon.eds_document import read_eds_folders
from tickrig.host.canmon.model.decode.eds_folder import EdsFiles
from tickrig.host.canmon.model.decode.node_memory import read_eds_objects
from tickrig.host.canmon.model.frames import load_text
from tickrig.host.canmon.model.recorder.recorder import Recorder, RecorderState
from tickrig.host.canmon.output.listening import bit_rates_of
from tickrig.host.canmon.output.recording import WORDS_METAVAR, read_recording
from tickrig.host.canmon.sources.source import BusSpec, LineSpec, parse_source
from tickrig.host.canmon.tui import settings as fields
from tickrig.host.canmon.tui.panels.alarms_panel import AlarmsPanel
from tickrig.host.canmon.tui.panels.panel import FrameWanted, Panel, make_panels
from tickrig.host.canmon.tui.panels.trace_panel import TracePanel
from tickrig.host.canmon.tui.session import DecodedFrame, Model, Session, Task, open_session
from tickrig.host.cli.messages import Refused, SourceFailed
from tickrig.host.text.toml_reader import load_toml
from tickrig.host.text.values import counted
from tickrig.host.text.whole_file import replacing, write_whole
from tickrig.host.tui import FramedApp, KeyFooter, Line
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.host.canmon.sources import bus_source
else:  # python-can is slow
    bus_source = LazyModule("tickrig.host.canmon.sources.bus_source")

# A task that records the traffic on request.

_LOOK_US: Final = 100_000
"""Interval of calls while no frame arrives."""

_WORDS: Final = "run.log"

_P = TypeVar("_P", bound=Panel)

_Light = tuple[str, str]
"""A text and its style."""


class RecorderTask(Task):
    """The recorder of the monitor, which writes the frames of the session into log files.

    The log is written in parts, so that no earlier file is overwritten.

    Args:
        session: session that supplies the frames.

    Attributes:
        section: name of the recorder's table in the workspace.
        words: settings of the recording as a text, which has the same form as the arguments of
            `canmon dump -l`.
        recorder: present or last recorder, or None before the first recording.
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
        """Time at which the next call is due, even if no frame arrives."""
        return self._due_us

    @property
    def running(self) -> bool:
        """Whether the recorder records, or waits for a trigger."""
        return self.recorder is not None and self.recorder.running

    @property
    def failed(self) -> str:
        """Reason why the latest recording ended early, empty if it did not."""
        return "" if self.recorder is None else self.recorder.failed

    def start(self, words: str) -> None:
        """Start a recording. From then on, a bus that goes away is opened again.

        Args:
            words: name of the file and options, separated by spaces, such as
                `run.log --rotate 100M`.

        Raises:
            ValueError: an option or the name of the file is invalid, or a file cannot be written.
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
        """End the recording. Report the result."""
        with self._session.lock:
            self._due_us = NEVER
            if self.recorder is None:
                return []
            self.recorder.close()
            return self.recorder.messages()

    def trigger(self) -> None:
        """Record the kept and the following frames."""
        with self._session.lock:
            if self.recorder is not None:
                self.recorder.trigger("key", self._session.model.now_us)

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
        """Record the frames. Nothing is sent."""
        session, recorder = self._session, self.recorder
        if recorder is not None and self._due_us != NEVER:
            self._due_us = now_us + _LOOK_US
            marks = [session.marks.popleft() for _ in range(len(session.marks))]
            recorder.take(records, session.source.lost, session.model.now_us, marks)
        return ()

    def light(self) -> list[_Light]:
        """Return the text about the recorder for the status line."""
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
        """Load the arguments of the last recording. Raise SettingError if they are invalid."""
        self.words = workspace.text_of(settings, "words", self.words)

    def save(self) -> dict[str, Any]:
        """Return the arguments of the last recording."""
        return {"words": self.words}


# The line at the bottom: how the bus is, what got lost, and whether frames may be sent.

ARMED: Final = (" ARMED ", "bold white on red")
_LISTENING: Final = (" LISTEN-ONLY ", "bold black on green")
_WARNING: Final = "bold yellow"
_ALARM: Final = "bold red"


class StatusLine(Widget):
    """The status line of the monitor, with the state of the session in one line of text.

    The line shows whether sending is armed, the buses with their loads, counts of frames, and
    faults. A click on the first word arms or disarms sending.

    Args:
        session: the session whose status it shows.
        recorder: recorder of the monitor.
    """

    DEFAULT_CSS = "StatusLine { height: 1; background: $boost; }"

    def __init__(self, session: Session, recorder: RecorderTask) -> None:
        super().__init__(id="status")
        self._session, self._recorder = session, recorder
        self._counts = [0]
        self.line: Line = ()

    def refresh_view(self) -> None:
        """Show the present status. The app calls this ten times a second."""
        with self._session.lock:
            line = self._status()
        if line != self.line:
            self.line = line
            self.refresh()

    def _status(self) -> Line:
        """Return the status line, with armed or not, the buses, counts, and faults."""
        session, model = self._session, self._session.model
        self._counts = [*self._counts[-10:], model.frames]
        line = [ARMED if session.armed else _LISTENING, *self._recorder.light()]
        for bus in model.top.traffic.buses(model.now_us):
            load = load_text(bus.load.latest.bit_s, model.top.view.bit_rate)
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
    """A field for the name of a file. Escape leaves it without a name.

    Args:
        name: initial content of the field.
        title: purpose of the name.
        example: text shown in an empty field.
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
        """Accept the name."""
        self.dismiss(event.value.strip())

    def action_leave(self) -> None:
        """Leave without a name."""
        self.dismiss("")


# The screen as a picture.

_FONTS: Final = re.compile(r"@font-face \{[^}]*\}")
"""Pattern of web fonts of Textual. Without them, the fonts of the reader are used."""
_CELL: Final = (8, 17)
_GROUND, _INK = "#121212", "#e0e0e0"


def _write_png(path: Path, strips: Sequence[Strip]) -> None:
    """Write lines of a screen as PNG with Pillow and a font of matplotlib.

    Raises:
        ImportError: matplotlib is not installed.
    """
    from matplotlib import get_data_path  # noqa: PLC0415 - an extra
    from PIL import Image, ImageDraw, ImageFont  # noqa: PLC0415 - with it

    wide, high = _CELL
    fonts = {
        bold: ImageFont.truetype(
            str(Path(get_data_path(), "fonts/ttf", f"DejaVuSansMono{'-Bold' * bold}.ttf")), 13
        )
        for bold in (False, True)
    }
    width = max(strip.cell_length for strip in strips) * wide
    image = Image.new("RGB", (width, len(strips) * high), _GROUND)
    draw = ImageDraw.Draw(image)
    for row, strip in enumerate(strips):
        column = 0
        for segment in strip:
            style = segment.style or Style()
            ink = style.color.get_truecolor().hex if style.color else _INK
            ground = style.bgcolor.get_truecolor(foreground=False).hex if style.bgcolor else _GROUND
            if style.reverse:
                ink, ground = ground, ink
            end = column + segment.cell_length
            draw.rectangle((column * wide, row * high, end * wide - 1, row * high + 16), ground)
            for letter in segment.text:  # each in its cell, whatever the font says
                draw.text((column * wide, row * high), letter, ink, fonts[bool(style.bold)])
                column += 1
            column = end
    with replacing(path) as beside:
        image.save(beside, "PNG")


# The parts that are replaced as a whole when buses or files change.


class _Work(NamedTuple):
    """A session, with the panels that show it, and its stored settings."""

    session: Session
    panels: tuple[Panel, ...]
    recorder: RecorderTask
    panel_settings: workspace.PanelSettings


def _ends(setup: workspace.MonitorSetup) -> set[tuple[str | None, str | None]]:
    """Return the buses and ports of a setup, by interface and channel."""
    words = [parse_source(word) for word in setup.source]
    found: set[tuple[str | None, str | None]] = set()
    for word in words or [BusSpec()]:
        if isinstance(word, BusSpec):
            whole = bus_source.merged(word, setup.options)
            found.add((whole.interface, whole.channel))
        elif isinstance(word, LineSpec):
            found.add(("serial", word.port))
    return found


def _read_files(setup: workspace.MonitorSetup) -> EdsFiles:
    """Read the EDS files. Raise InputError if a file is not an EDS."""
    with fields.of_field("eds"):
        objects = {node: read_eds_objects(path, node) for node, path in setup.eds.items()}
    with fields.of_field("eds_dir"):
        return EdsFiles(objects, read_eds_folders(setup.eds_dir))


_FIELDS: Final = {"trace": "filter", "alarms": "rules"}
"""Fields of settings, by the panels that use them."""


def _hand_on(
    before: Panel | RecorderTask,
    after: Panel | RecorderTask,
    changes: dict[str, Any],
    buses: Mapping[str, object],
) -> None:
    """Pass settings of a panel to another panel, with changes. Raise InputError if one is wrong."""
    scratch = workspace.Workspace()
    scratch.put(before.section, before.save())
    settings = scratch.section(before.section) | changes
    if settings.get("bus") not in buses:
        settings.pop("bus", None)
    try:
        after.load(settings)
    except workspace.SettingError as error:
        raise fields.InputError(_FIELDS.get(before.section, "source"), str(error)) from None


_PAINT_S: Final = 0.1
_SAVE_S: Final = 2.0
_SWITCH_S: Final = 0.002
"""Longest time that the screen may keep the session from running."""


class MonitorApp(FramedApp):
    """The Textual app of `canmon tui`: tabs, keys, help and the status line.

    Args:
        session: session with the traffic and the buses to send on. The caller of the app starts the
            session.
        panels: panels, each of which is one tab.
        panel_settings: storage of the panels' settings. If it is None, settings are stored only
            when the user exports them.
        recorder: recorder of the monitor. By default, a new recorder is used.

    Attributes:
        reopens: whether a bus that goes away is opened again.
        asks: whether the app begins with the settings screen, because the user named no source.
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
        Binding("f2", "settings", "settings", key_display="F2"),
        Binding("f3", "times", "times", key_display="F3"),
        Binding("f12", "picture", "picture", key_display="F12"),
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
        self.reopens = self.asks = False
        self._moving, self._section = False, panels[0].section
        self.animation_level = "none"  # each picture goes over a line that may be slow
        self.session, self.panels = session, tuple(panels)
        self.panel_settings = panel_settings or workspace.PanelSettings(
            workspace.Workspace(), workspace.MonitorSetup(), [*panels, self.recorder]
        )

    def compose(self) -> ComposeResult:
        """Lay out the tabs."""
        with TabbedContent(initial=f"tab-{self._section}"):
            for number, panel in enumerate(self.panels, 1):
                with TabPane(f"{number} {panel.title}", id=_tab(panel)):
                    yield panel
        yield StatusLine(self.session, self.recorder)
        yield KeyFooter()

    def on_mount(self) -> None:
        """Start updating the screen."""
        self.set_interval(_PAINT_S, self.refresh_view)
        self.set_interval(_SAVE_S, self.save)
        if self.asks:
            self.call_after_refresh(self.action_settings)
        if unknown := self.panel_settings.unknown():
            self.notify(f"not known here, and kept: {', '.join(unknown)}", severity="warning")

    def run_session(self) -> None:
        """Read the source in a thread. Show the panels until the user leaves."""
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
        """Stop sending at once, then end the app."""
        self.session.armed = False
        super().end()

    def save(self) -> None:
        """Store the settings."""
        if trouble := self.panel_settings.save():
            self.notify(trouble, severity="error", timeout=10)

    @property
    def shown(self) -> Panel:
        """Panel that is on the screen."""
        active = self.query_one(TabbedContent).active
        return next(panel for panel in self.panels if _tab(panel) == active)

    def refresh_view(self) -> None:
        """Update the panel that is on the screen."""
        self.session.check()
        if self.screen_stack and not self._moving and self.query(StatusLine):
            while self.session.notes:
                self.notify(self.session.notes.popleft(), timeout=10)
            self.shown.refresh_view()
            self.query_one(StatusLine).refresh_view()

    def on_tabbed_content_tab_activated(self) -> None:
        """Pass the keys to the panel, and update it at once."""
        self._section = self.shown.section
        if not self.shown.query("*:focus"):
            self.shown.enter()
        self.refresh_view()

    def action_tab(self, number: int) -> None:
        """Show a tab."""
        if number <= len(self.panels):
            self.query_one(TabbedContent).active = _tab(self.panels[number - 1])

    def action_arm(self) -> None:
        """Arm or disarm sending by the panels."""
        if self.session.armed:
            self.session.disarm()
        elif self.session.can_send:
            self.session.arm()
        else:
            self.notify("nothing is sent into a log", severity="warning")

    def action_export(self) -> None:
        """Ask for a file, and store the settings in this file."""
        path = self.panel_settings.workspace.path
        self._prompt(_ExportScreen("" if path is None else str(path)), self._export)

    def _prompt(self, screen: _ExportScreen, act: Callable[[str], str | None]) -> None:
        """Ask for a text, act with it, and show the message or the error of this."""

        def take(text: str | None) -> None:
            if text:
                try:
                    said = act(text)
                except (OSError, ValueError) as error:
                    self.notify(str(error), severity="error")
                    return
                if said:
                    self.notify(said)

        self.push_screen(screen, take)

    def _export(self, name: str) -> str:
        self.panel_settings.export(Path(name))
        return f"settings are kept in {name}"

    def action_settings(self) -> None:
        """Show the settings screen, and apply changes."""
        trace, alarms = self._panel(TracePanel), self._panel(AlarmsPanel)
        now = fields.MonitorSettings(
            self.panel_settings.setup,
            trace.filter_text if trace else "",
            alarms.rules_text if alarms else "",
        )
        self.push_screen(fields.SettingsScreen(now, partial(self._apply, now)))

    def _say_applied(self) -> None:
        path = self.panel_settings.workspace.path
        self.notify("settings are applied" + ("; w keeps them in a file" if path is None else ""))

    def _apply(self, before: fields.MonitorSettings, after: fields.MonitorSettings) -> None:
        """Apply other settings. Raise InputError without a change if they cannot be used."""
        changes: dict[str, dict[str, Any]] = {}
        if after.filter != before.filter:
            changes["trace"] = {"filter": after.filter}
        if after.rules != before.rules:
            changes["alarms"] = {"rules": load_toml(after.rules)}
        if after.setup == before.setup:
            self._apply_words(changes, after)
            self._say_applied()
        elif self.recorder.running:
            raise fields.InputError("source", "a recording runs: F8 ends it")
        else:
            work = self._opened(before.setup, after.setup, changes)
            self._moving = True
            self.call_later(self._move, work)

    def _apply_words(self, changes: Mapping[str, object], after: fields.MonitorSettings) -> None:
        trace, alarms = self._panel(TracePanel), self._panel(AlarmsPanel)
        if alarms and "alarms" in changes:
            with fields.of_field("rules"):
                alarms.take_rules(after.rules)
        if trace and "trace" in changes:
            with fields.of_field("filter"):
                trace.apply_filter(after.filter)

    def _opened(
        self,
        before: workspace.MonitorSetup,
        after: workspace.MonitorSetup,
        changes: Mapping[str, dict[str, Any]],
    ) -> _Work:
        """Open other buses or files in place of the present ones. Raise InputError if that fails.

        A bus that is in both the old and the new settings is closed first, because most adapters
        can be opened only once. If the bus cannot be opened with the new settings, it is opened
        with the old ones.
        """
        old, files = self.session, _read_files(after)
        with fields.of_field("dbc"):
            model = Model(files, after.dbc, *bit_rates_of(after.source, after.options))
        is_same = (before.source, before.options) == (after.source, after.options)
        if is_same and old.source.live and not old.source.ended:
            work = self._made(old.over(model), after, changes)
            old.close()
            rows = old.model.trace.rows(old.model.trace.first, old.model.trace.count)
            work.session.feed([row.record for row in rows])
            return work
        if "-" in after.source:
            raise fields.InputError("source", "standard input can be named at the start only")
        shares = bool(_ends(before) & _ends(after))
        if shares:
            self._close(old)
        try:
            with fields.of_field("source"):
                session = open_session(after.source, after.options, model)
            try:
                work = self._made(session, after, changes)
            except fields.InputError:
                session.source.close()
                raise
        except fields.InputError:
            if shares:
                self._open_again(old, before)
            raise
        if not shares:
            self._close(old)
        return work

    def _close(self, session: Session) -> None:
        session.disarm()
        session.close()
        session.source.close()

    def _open_again(self, session: Session, setup: workspace.MonitorSetup) -> None:
        """Continue a session that was closed for other sources, which could not be opened."""
        try:
            again = open_session(setup.source, setup.options, Model())
        except (Refused, SourceFailed) as error:
            session.model.failed = f"{error.message}; F2 opens another bus"
            return
        session.resume(again.source, again.buses)
        if self.reopens:
            session.source.reopen()

    def _made(
        self,
        session: Session,
        setup: workspace.MonitorSetup,
        changes: Mapping[str, dict[str, Any]],
    ) -> _Work:
        """Return new panels for a session, with the settings of the shown panels and changes."""
        panels, recorder = make_panels(session, session.notes.append), RecorderTask(session)
        by_section = {panel.section: panel for panel in panels}
        for one in self.panels:
            if one.section in by_section:
                change = changes.get(one.section, {})
                _hand_on(one, by_section[one.section], change, session.buses)
        _hand_on(self.recorder, recorder, {}, {})
        panel_settings = workspace.PanelSettings(
            self.panel_settings.workspace, setup, [*panels, recorder]
        )
        return _Work(session, tuple(panels), recorder, panel_settings)

    async def _move(self, work: _Work) -> None:
        """Show another session in place of the closed session."""
        started = self.session.started
        self.session, self.panels, self.recorder, self.panel_settings = work
        base = self.screen_stack[0]
        async with base.batch():
            await base.query("*").exclude(".-textual-system").remove()
            await base.mount_all(compose(self))
        self._moving = False
        if self.reopens:
            self.session.source.reopen()
        if started:
            self.session.start()
        self.save()
        self._say_applied()
        self.refresh_view()

    def _panel(self, kind: type[_P]) -> _P | None:
        return next((panel for panel in self.panels if isinstance(panel, kind)), None)

    def action_picture(self) -> None:
        """Ask for a file, and save the screen as a picture."""
        name = f"canmon-{self.shown.title}.svg"
        screen = _ExportScreen(name, "save the screen as", ".svg or .png")
        self._prompt(screen, lambda text: self._write_picture(Path(text)))

    def _write_picture(self, path: Path) -> str:
        """Write the screen as a picture. Return a message. Raise ValueError for other suffixes."""
        said = ""
        if path.suffix.lower() not in (".svg", ".png"):
            raise ValueError(f"{path}: a picture of the screen is .svg or .png")
        if path.suffix.lower() == ".png":
            strips = self.screen._compositor.render_strips()  # as export_screenshot does
            try:
                _write_png(path, strips)
            except ImportError:
                said = "PNG needs matplotlib: pip install 'tickrig[plot]'; "
                path = path.with_suffix(".svg")
        if path.suffix.lower() == ".svg":
            write_whole(path, _FONTS.sub("", self.export_screenshot(title="canmon tui")))
        return f"{said}{path} is written"

    def action_times(self) -> None:
        """Change the format of times in all tabs."""
        self.session.next_stamp()
        self.refresh_view()

    def on_frame_wanted(self, event: FrameWanted) -> None:
        """Show a frame in the trace."""
        trace = self._panel(TracePanel)
        if trace is not None:
            self.query_one(TabbedContent).active = _tab(trace)
            self.call_after_refresh(trace.show_frame, event.at_us, event.record)

    def action_record(self) -> None:
        """Ask for a recording, or end the recording."""
        if self.recorder.running:
            self.notify("\n".join(self.recorder.end()), markup=False)
        elif not self.session.source.live:
            self.notify("all of a log is there: canmon conv writes it into another")
        else:
            screen = _ExportScreen(self.recorder.words, "record into", WORDS_METAVAR)
            self._prompt(screen, self.recorder.start)

    def action_trigger(self) -> None:
        """Record the kept and the following frames."""
        if not self.recorder.running:
            self.notify("nothing waits for a trigger: F8 records, as run.log --pre 5s")
        self.recorder.trigger()

    def get_system_commands(self, screen: Screen[object]) -> Iterable[SystemCommand]:
        """Yield the entries of Textual's command palette, which are the tabs and the shown keys.

        The keys are those of the app and of the visible panel.
        """
        yield from super().get_system_commands(screen)
        for number, panel in enumerate(self.panels, 1):
            yield SystemCommand(panel.title, f"show tab {number}", partial(self.action_tab, number))
        for owner in (self, self.shown):
            for _, binding in owner._bindings:
                if binding.show:
                    run = partial(self.run_action, binding.action, owner)
                    yield SystemCommand(binding.description, f"key {binding.key}", run)

    def action_stop(self) -> None:
        """Stop everything that sends, at once."""
        self.session.disarm()


def _tab(panel: Panel) -> str:
    return f"tab-{panel.section}"
