"""What a workspace keeps: buses and files of nodes, and the settings of all panels.

`[bus]` and `[nodes.3]` of a workspace; what the command line says goes before.
Paths in the file are taken from its own folder.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Final, Protocol, Self, TypeGuard

from tickrig.host.canmon.sources.source_spec import FileSpec, parse_source
from tickrig.host.canmon.workspace import SettingError, Workspace, WorkspaceError
from tickrig.host.cli.can_options import BusOptions

BUS: Final = "bus"
NODES: Final = "nodes"
_OPTIONS: Final = tuple(field.name for field in fields(BusOptions))
_WHOLE: Final = ("bitrate", "data_bitrate")
_SWITCHES: Final = ("fd",)
_LISTS: Final = ("source", "dbc", "timing", "bus_kwargs")


@dataclass(frozen=True, slots=True, kw_only=True)
class MonitorSetup:
    """Sources and files.

    Attributes:
        source: SOURCE words.
        options: of the buses.
        eds: files by node-ID.
        dbc: files.
    """

    source: tuple[str, ...] = ()
    options: BusOptions = field(default_factory=BusOptions)
    eds: Mapping[int, Path] = field(default_factory=dict)
    dbc: tuple[Path, ...] = ()

    @classmethod
    def read(cls, workspace: Workspace) -> Self:
        """Read what a workspace says.

        Raises:
            WorkspaceError: a setting is wrong; says its line.
        """
        bus, nodes = workspace.section(BUS), workspace.section(NODES)
        folder = _folder(workspace)
        try:
            _check(bus)
        except SettingError as error:
            raise workspace.wrong(error, BUS) from None
        try:
            eds = {_node(key): folder / path for key, path in _eds(nodes)}
        except SettingError as error:
            raise workspace.wrong(error, NODES) from None
        given = {name: bus[name] for name in _OPTIONS if name in bus}
        for name in ("timing", "bus_kwargs"):
            given[name] = tuple(given.get(name, ()))
        return cls(
            source=tuple(_word(folder, word) for word in bus.get("source", ())),
            options=BusOptions(**given),
            eds=eds,
            dbc=tuple(folder / path for path in bus.get("dbc", ())),
        )

    def under(self, other: MonitorSetup) -> MonitorSetup:
        """Return it with what another one says before it."""
        options = self.options if not other.source else BusOptions(bitrate=self.options.bitrate)
        given = {name: value for name in _OPTIONS if (value := getattr(other.options, name))}
        return MonitorSetup(
            source=other.source or (() if other.options else self.source),
            options=replace(options, **given),
            eds={**self.eds, **other.eds},
            dbc=other.dbc or self.dbc,
        )

    def write(self, workspace: Workspace) -> None:
        """Put it into a workspace."""
        bus: dict[str, Any] = {
            name: list(value) if isinstance(value, tuple) else value
            for name in _OPTIONS
            if (value := getattr(self.options, name))
        }
        bus["source"] = [_relative(workspace, word) for word in self.source]
        if self.dbc:
            bus["dbc"] = [_relative(workspace, str(path), is_path=True) for path in self.dbc]
        workspace.put(BUS, bus)
        workspace.put(
            NODES,
            {
                str(node): {"eds": _relative(workspace, str(path), is_path=True)}
                for node, path in sorted(self.eds.items())
            },
        )


def _folder(workspace: Workspace) -> Path:
    return Path() if workspace.path is None else workspace.path.parent


def _is_text(value: object) -> TypeGuard[str]:
    """Say whether a value is a text as a command line may have it: without NUL."""
    return isinstance(value, str) and "\0" not in value


def _check(bus: Mapping[str, Any]) -> None:
    for name, value in bus.items():
        if name in _LISTS:
            if not isinstance(value, list) or not all(map(_is_text, value)):
                raise SettingError((name,), "is no array of texts")
        elif name in _WHOLE:
            if type(value) is not int or value < 1:
                raise SettingError((name,), f"{value!r} is not a number of bit/s")
        elif name in _SWITCHES:
            if type(value) is not bool:
                raise SettingError((name,), f"{value!r} is neither true nor false")
        elif name in _OPTIONS and not _is_text(value):
            raise SettingError((name,), f"{value!r} is no text")


def _eds(nodes: Mapping[str, Any]) -> Sequence[tuple[str, str]]:
    found = []
    for key, settings in nodes.items():
        _node(key)
        path = settings.get("eds", "") if isinstance(settings, dict) else None
        if not _is_text(path):
            raise SettingError((key,), 'is no table with eds = "FILE"')
        found += [(key, path)] if path else []
    return found


def _node(key: str) -> int:
    if not key.isdecimal() or not 1 <= int(key) <= 127:
        raise SettingError((key,), "is not a node-ID 1..127")
    return int(key)


def _word(folder: Path, word: str) -> str:
    return str(folder / word) if _is_log(word) else word


def _is_log(word: str) -> bool:
    return isinstance(parse_source(word), FileSpec)


def _relative(workspace: Workspace, word: str, *, is_path: bool = False) -> str:
    """Write a path as seen from the workspace's folder."""
    if not is_path and not _is_log(word):
        return word
    return os.path.relpath(Path(word).resolve(), _folder(workspace).resolve())


FRAME: Final = (BUS, NODES)
"""Sections that are no panel's."""


class Kept(Protocol):
    """What has settings in a workspace, as a panel."""

    @property
    def section(self) -> str:
        """Its table."""
        ...

    def load(self, settings: Mapping[str, Any], /) -> None:
        """Take settings; SettingError if one is wrong."""
        ...

    def save(self) -> dict[str, Any]:
        """Return all its settings."""
        ...


class PanelSettings:
    """Recalls settings, and keeps them.

    Args:
        workspace: where they are kept.
        setup: buses and files, as they are used.
        panels: whose settings they are.
    """

    def __init__(self, workspace: Workspace, setup: MonitorSetup, panels: Sequence[Kept]) -> None:
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
