"""The settings of all panels in one workspace."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from tickrig.host.canmon.bench_setup import BUS, NODES, BenchSetup
from tickrig.host.canmon.tui.panels.panel import Panel
from tickrig.host.canmon.workspace import SettingError, Workspace, WorkspaceError

FRAME: Final = (BUS, NODES)
"""Sections that are no panel's."""


class Bench:
    """Recalls settings, and keeps them.

    Args:
        workspace: where they are kept.
        setup: buses and files, as they are used.
        panels: whose settings they are.
    """

    def __init__(self, workspace: Workspace, setup: BenchSetup, panels: Sequence[Panel]) -> None:
        self.workspace, self._setup, self._panels = workspace, setup, tuple(panels)
        self._conflict = ""

    def load(self) -> None:
        """Give each panel its settings.

        Raises:
            WorkspaceError: a setting is wrong; says its line.
        """
        for panel in self._panels:
            try:
                panel.load(self.workspace.section(panel.section))
            except SettingError as error:
                raise self.workspace.wrong(error, panel.section) from None

    def unknown(self) -> list[str]:
        """Return what of the workspace nobody here knows; it stays in the file."""
        known = {panel.section: set(panel.save()) for panel in self._panels}
        words = [name for name in self.workspace.sections() if name not in (*FRAME, *known)]
        for name, keys in known.items():
            words += [f"{name}.{key}" for key in self.workspace.section(name) if key not in keys]
        return words

    def save(self) -> str:
        """Write what has changed; return what went wrong, once.

        A file that somebody else has changed is not touched until it is exported.
        """
        self._put()
        try:
            self.workspace.write()
        except WorkspaceError as error:
            said, self._conflict = self._conflict, str(error)
            return "" if said == self._conflict else self._conflict
        self._conflict = ""
        return ""

    def export(self, path: Path) -> None:
        """Write all to a file, and keep it there from now on.

        Raises:
            WorkspaceError: it cannot be written.
        """
        before, self.workspace.path = self.workspace.path, path
        self._put()
        try:
            self.workspace.write(over=True)
        except WorkspaceError:
            self.workspace.path = before
            raise

    def _put(self) -> None:
        self._setup.write(self.workspace)
        for panel in self._panels:
            self.workspace.put(panel.section, panel.save())
