"""The monitor: tabs of panels over one session."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import ClassVar, Final

import click
from textual.app import ComposeResult, SystemCommand
from textual.binding import Binding, BindingType
from textual.screen import ModalScreen, Screen
from textual.widgets import Input, TabbedContent, TabPane

from tickrig.host.canmon.errors import SourceFailed
from tickrig.host.canmon.monitor_setup import MonitorSetup, PanelSettings
from tickrig.host.canmon.output.recording import WORDS_METAVAR
from tickrig.host.canmon.tui.panels.panel import Panel
from tickrig.host.canmon.tui.status_line import StatusLine
from tickrig.host.canmon.tui.tasks.recorder_task import RecorderTask
from tickrig.host.canmon.tui.tasks.session import Session
from tickrig.host.canmon.workspace import Workspace, WorkspaceError
from tickrig.host.tui.framed_app import FramedApp
from tickrig.host.tui.key_footer import KeyFooter


class ExportScreen(ModalScreen[str]):
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


PAINT_S: Final = 0.1
SAVE_S: Final = 2.0
SWITCH_S: Final = 0.002
"""How long the screen may keep the session from running."""


class Monitor(FramedApp):
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
        panel_settings: PanelSettings | None = None,
        recorder: RecorderTask | None = None,
    ) -> None:
        super().__init__()
        self.recorder = recorder or RecorderTask(session)
        self.animation_level = "none"  # each picture goes over a line that may be slow
        self.session, self.panels = session, tuple(panels)
        self.panel_settings = panel_settings or PanelSettings(
            Workspace(), MonitorSetup(), [*panels, self.recorder]
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
        self.set_interval(PAINT_S, self.refresh_view)
        self.set_interval(SAVE_S, self.save)
        if unknown := self.panel_settings.unknown():
            self.notify(f"not known here, and kept: {', '.join(unknown)}", severity="warning")

    def run_session(self) -> None:
        """Read the source in a thread and show the panels until they are left."""
        before_s, said = sys.getswitchinterval(), []
        sys.setswitchinterval(SWITCH_S)
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
        self.push_screen(ExportScreen("" if path is None else str(path)), self._export)

    def _export(self, name: str | None) -> None:
        if name:
            try:
                self.panel_settings.export(Path(name))
            except WorkspaceError as error:
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
            screen = ExportScreen(self.recorder.words, "record into", WORDS_METAVAR)
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
