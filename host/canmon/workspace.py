"""The workspace, which is one TOML file for the settings of all panels.

The file is read and written as a whole. Writing uses a temporary file, so that a partial file never
exists. Unknown settings and comments are kept. A file that another program has changed is not
overwritten.

The settings of a panel in a workspace are checked one by one.

>>> truth({"bits": True}, "bits", False), choice({}, "time", "z", ["z", "d"])
(True, 'z')

>>> texts_of({"counter": ["0:0..3"]}, "counter"), texts_of({}, "counter")
(('0:0..3',), ())
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol, Self, TypeGuard

from tickrig.host.canmon.sources.source import FileSpec, parse_source
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.text.toml_reader import read_toml
from tickrig.host.text.whole_file import write_whole

if TYPE_CHECKING:
    from tomlkit import TOMLDocument
    from tomlkit.container import Container
    from tomlkit.items import Table


_MOST: Final = 200_000
"""Maximum number of characters. The time of tomlkit grows with the square of this number."""


class SettingError(ValueError):
    """A setting in a workspace file is invalid.

    The panel or function that reads the setting raises it.

    Attributes:
        path: keys and indices that lead to the setting, from the table of the panel.
    """

    def __init__(self, path: Sequence[str | int], reason: str) -> None:
        super().__init__(f"{'.'.join(map(str, path))}: {reason}")
        self.path = tuple(path)


class WorkspaceError(ValueError):
    """A workspace file cannot be used or written. The message is one line that names the file."""


class Workspace:
    """The settings of the monitor in a workspace file, which is a TOML file with named sections.

    Args:
        text: content of the file as TOML.
        path: path of the file, or None for settings that are not stored.

    Raises:
        WorkspaceError: the text is not TOML, or tomlkit is not installed. The message names the
            line.
    """

    def __init__(self, text: str = "", path: Path | None = None) -> None:
        try:
            import tomlkit  # noqa: PLC0415 - an extra
            from tomlkit.exceptions import ParseError, TOMLKitError  # noqa: PLC0415
        except ImportError as error:
            raise WorkspaceError("workspaces need tomlkit: pip install 'tickrig[tui]'") from error
        self.path, self._text = path, text
        if len(text) > _MOST:
            raise WorkspaceError(f"{path}: more than {_MOST:,} characters: no workspace")
        try:
            self._document: TOMLDocument = tomlkit.parse(text)
            self._document.unwrap()  # some tables that are there twice are found by it alone
        except ParseError as error:
            raise WorkspaceError(f"{path}, line {error.line}: {_reason(error)}") from None
        except TOMLKitError as error:
            raise WorkspaceError(f"{path}: {_reason(error)}") from None

    @classmethod
    def read(cls, path: Path) -> Workspace:
        """Read a workspace file. If the file does not exist yet, the workspace is empty.

        Raises:
            WorkspaceError: the file cannot be read, or is not TOML.
        """
        try:
            return cls(path.read_text("utf-8"), path)
        except FileNotFoundError:
            return cls("", path)
        except OSError as error:
            raise WorkspaceError(f"{path}: {error.strerror}") from None
        except UnicodeDecodeError:
            raise WorkspaceError(f"{path} is no text") from None

    def sections(self) -> list[str]:
        """Return the names of all sections."""
        return list(self._document)

    def section(self, name: str) -> dict[str, Any]:
        """Return the settings of one section of the file, empty if the section does not exist.

        Raises:
            WorkspaceError: the section is not a table.
        """
        found = self._document.unwrap().get(name, {})
        if not isinstance(found, dict):
            raise self.wrong(SettingError((name,), "is no table"))
        return found

    def wrong(self, error: SettingError, section: str = "") -> WorkspaceError:
        """Return an error that also names the line of the invalid setting."""
        path = (section, *error.path) if section else error.path
        place = read_toml(self._text).line_of(path)
        name = f"{section}.{error}" if section else str(error)
        return WorkspaceError(f"{self.path}, line {place}: {name}")

    def put(self, name: str, settings: Mapping[str, Any]) -> None:
        """Change settings of one section, without writing the file.

        If a value is None, its key is removed. Keys that `settings` does not contain are not
        changed.
        """
        if settings:
            _merge(self._document, {name: settings})

    @property
    def text(self) -> str:
        """The whole text, as it would be written."""
        return self._document.as_string()

    def write(self, *, over: bool = False) -> bool:
        """Write the settings to the file if they have changed. Return whether they have changed.

        Args:
            over: whether to overwrite the file even if another program has changed it.

        Raises:
            WorkspaceError: the file cannot be written, or has changed since it was last read or
                written.
        """
        text, path = self.text, self.path
        if path is None or (text == self._text and not over):
            return False
        try:
            if not over and self._differs(path):
                raise WorkspaceError(f"{path} was changed by another program: not saved")
            write_whole(path, text)
        except OSError as error:
            raise WorkspaceError(f"{path}: {error.strerror}: not saved") from None
        self._text = text
        return True

    def _differs(self, path: Path) -> bool:
        """Return whether a file differs from the text that was last read or written."""
        try:
            return path.read_bytes() != self._text.encode()
        except FileNotFoundError:
            return False


def _reason(error: Exception) -> str:
    return str(error).split(" at line ")[0]


def _merge(table: Container | Table | Any, settings: Mapping[str, Any]) -> None:
    """Set the values that differ. Tables and arrays of tables are compared key by key."""
    for key, value in settings.items():
        before = table.get(key)
        if value is None:
            table.pop(key, None)
        elif isinstance(value, Mapping) and isinstance(before, Mapping):
            _merge(before, value)
        elif _are_tables(value) and _are_tables(before):
            _merge_array(before, value)
        elif before != value:
            table[key] = _given(value)


def _merge_array(tables: Any, values: Sequence[Mapping[str, Any]]) -> None:
    for place, value in enumerate(values):
        if place < len(tables):
            _merge(tables[place], value)
        else:
            tables.append(_given(value))
    while len(tables) > len(values):
        del tables[-1]


def _given(value: Any) -> Any:
    """Return a setting without None values."""
    if isinstance(value, Mapping):
        return {name: _given(item) for name, item in value.items() if item is not None}
    return [_given(item) for item in value] if isinstance(value, list) else value


def _are_tables(value: object) -> bool:
    return (
        isinstance(value, Sequence)
        and not isinstance(value, str)
        and bool(value)
        and all(isinstance(item, Mapping) for item in value)
    )


# Content of a workspace: buses, files of nodes, and the settings of all panels.
#
# `[bus]` and `[nodes.3]` of a workspace; what the command line says goes before.
# Paths in the file are taken from its own folder.

_BUS: Final = "bus"
_NODES: Final = "nodes"
_OPTIONS: Final = tuple(field.name for field in fields(BusOptions))
_WHOLE: Final = ("bitrate", "data_bitrate")
_SWITCHES: Final = ("fd",)
_LISTS: Final = ("source", "dbc", "eds_dir", "timing", "bus_kwargs")


@dataclass(frozen=True, slots=True, kw_only=True)
class MonitorSetup:
    """Sources and files that the monitor `canmon tui` was started with.

    Attributes:
        source: SOURCE arguments of the command, such as the name of a bus or of a log file.
        options: options of the buses.
        eds: paths of EDS files by node-ID.
        dbc: paths of DBC files.
        eds_dir: folders of EDS files for nodes that are not in `eds`.
    """

    source: tuple[str, ...] = ()
    options: BusOptions = field(default_factory=BusOptions)
    eds: Mapping[int, Path] = field(default_factory=dict)
    dbc: tuple[Path, ...] = ()
    eds_dir: tuple[Path, ...] = ()

    @classmethod
    def read(cls, workspace: Workspace) -> Self:
        """Return the sources and files that a workspace file contains.

        Raises:
            WorkspaceError: a setting is invalid. The message names its line.
        """
        bus, nodes = workspace.section(_BUS), workspace.section(_NODES)
        folder = _folder(workspace)
        try:
            _check(bus)
        except SettingError as error:
            raise workspace.wrong(error, _BUS) from None
        try:
            eds = {_node(key): folder / path for key, path in _eds(nodes)}
        except SettingError as error:
            raise workspace.wrong(error, _NODES) from None
        given = {name: bus[name] for name in _OPTIONS if name in bus}
        for name in ("timing", "bus_kwargs"):
            given[name] = tuple(given.get(name, ()))
        return cls(
            source=tuple(_word(folder, word) for word in bus.get("source", ())),
            options=BusOptions(**given),
            eds=eds,
            dbc=tuple(folder / path for path in bus.get("dbc", ())),
            eds_dir=tuple(folder / path for path in bus.get("eds_dir", ())),
        )

    def under(self, other: MonitorSetup) -> MonitorSetup:
        """Return this setup combined with another setup, whose values take precedence."""
        options = self.options if not other.source else BusOptions(bitrate=self.options.bitrate)
        given = {name: value for name in _OPTIONS if (value := getattr(other.options, name))}
        return MonitorSetup(
            source=other.source or (() if other.options else self.source),
            options=replace(options, **given),
            eds={**self.eds, **other.eds},
            dbc=other.dbc or self.dbc,
            eds_dir=other.eds_dir or self.eds_dir,
        )

    def write(self, workspace: Workspace) -> None:
        """Write the setup to a workspace. Values that the setup lacks are removed."""
        bus: dict[str, Any] = {
            name: (list(value) if isinstance(value, tuple) else value) or None
            for name, value in asdict(self.options).items()
        }
        bus["source"] = [_relative(workspace, word) for word in self.source]
        for name, paths in (("dbc", self.dbc), ("eds_dir", self.eds_dir)):
            words = [_relative(workspace, str(path), is_path=True) for path in paths]
            bus[name] = words or None
        workspace.put(_BUS, bus)
        kept = workspace.section(_NODES)
        nodes: dict[str, Any] = {key: {"eds": None} for key, node in kept.items() if "eds" in node}
        for node, path in sorted(self.eds.items()):
            nodes[str(node)] = {"eds": _relative(workspace, str(path), is_path=True)}
        workspace.put(_NODES, nodes)


def _folder(workspace: Workspace) -> Path:
    return Path() if workspace.path is None else workspace.path.parent


def _is_text(value: object) -> TypeGuard[str]:
    """Return whether a value is a text that a command line may contain, which has no NUL."""
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
    """Return a path relative to the folder of the workspace."""
    if not is_path and not _is_log(word):
        return word
    return os.path.relpath(Path(word).resolve(), _folder(workspace).resolve())


_FRAME: Final = (_BUS, _NODES)
"""Sections that do not belong to a panel."""


class _Kept(Protocol):
    """An object with settings in a workspace, such as a panel."""

    @property
    def section(self) -> str:
        """Name of the object's table."""

    def load(self, settings: Mapping[str, Any], /) -> None:
        """Load settings. Raise SettingError if a setting is wrong."""

    def save(self) -> dict[str, Any]:
        """Return all its settings."""


class PanelSettings:
    """Storage that connects the panels of the monitor with a workspace file.

    The storage loads the settings of the panels from the file, and saves them to the file.

    Args:
        workspace: workspace file with the settings.
        setup: sources and files in use.
        panels: panels whose settings are stored.
    """

    def __init__(self, workspace: Workspace, setup: MonitorSetup, panels: Sequence[_Kept]) -> None:
        self.workspace, self.setup, self._panels = workspace, setup, tuple(panels)
        self._conflict = ""

    def load(self) -> None:
        """Pass to each panel its settings from the workspace.

        Raises:
            WorkspaceError: a setting is wrong. The message names its line.
        """
        for panel in self._panels:
            try:
                panel.load(self.workspace.section(panel.section))
            except SettingError as error:
                raise self.workspace.wrong(error, panel.section) from None

    def unknown(self) -> list[str]:
        """Return the unknown settings of the workspace. Unknown settings stay in the file."""
        known = {panel.section: set(panel.save()) for panel in self._panels}
        words = [name for name in self.workspace.sections() if name not in (*_FRAME, *known)]
        for name, keys in known.items():
            words += [f"{name}.{key}" for key in self.workspace.section(name) if key not in keys]
        return words

    def save(self) -> str:
        """Write changed settings of the panels to the workspace file.

        If the file cannot be written, return the text of the error, otherwise an empty text. The
        same error is returned only once. If another program has changed the file, the settings are
        not written until the user exports them.
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
        """Write all settings of the panels to a file, and use this file from then on.

        Raises:
            WorkspaceError: the file cannot be written.
        """
        before, self.workspace.path = self.workspace.path, path
        self._put()
        try:
            self.workspace.write(over=True)
        except WorkspaceError:
            self.workspace.path = before
            raise

    def _put(self) -> None:
        self.setup.write(self.workspace)
        for panel in self._panels:
            self.workspace.put(panel.section, panel.save())


def truth(settings: Mapping[str, Any], name: str, default: bool) -> bool:
    """Return a boolean. Raise SettingError if the value is not a boolean."""
    value = settings.get(name, default)
    if not isinstance(value, bool):
        raise SettingError((name,), f"{value!r} is neither true nor false")
    return value


def text_of(settings: Mapping[str, Any], name: str, default: str) -> str:
    """Return a text. Raise SettingError if the value is not a text."""
    value = settings.get(name, default)
    if not isinstance(value, str):
        raise SettingError((name,), f"{value!r} is no text")
    return value


def choice(settings: Mapping[str, Any], name: str, default: str, known: Sequence[str]) -> str:
    """Return a setting whose value must be one of the texts in `known`.

    Args:
        settings: settings of a panel.
        name: key of the setting.
        default: value if the setting is missing.
        known: allowed values.

    Raises:
        SettingError: the value is not allowed.
    """
    value = settings.get(name, default)
    if value not in known:
        raise SettingError((name,), f"{value!r} is not one of {', '.join(known)}")
    return str(value)


def tables(settings: Mapping[str, Any], name: str) -> list[Mapping[str, Any]]:
    """Return a setting that is a TOML array of tables, or an empty list if it is missing.

    Raises:
        SettingError: the value is not an array of tables.
    """
    value = settings.get(name, [])
    if not isinstance(value, list) or not all(isinstance(item, Mapping) for item in value):
        raise SettingError((name,), f"is no array of tables [[{name}]]")
    return value


def texts_of(settings: Mapping[str, Any], name: str) -> tuple[str, ...]:
    """Return a setting that is a list of texts, or an empty tuple if it is missing.

    Raises:
        SettingError: the value is not a list of texts.
    """
    value = settings.get(name, [])
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        raise SettingError((name,), f"{value!r} is no list of texts")
    return tuple(value)


@contextmanager
def below(*path: str | int) -> Iterator[None]:
    """Context manager for reading a nested table, so that errors name the full path of a setting.

    The argument `path` contains the keys that lead to the nested table. If the block raises a
    SettingError, the context manager puts these keys in front of the path in the error. If the
    block raises any other ValueError, it becomes a SettingError with these keys as its path.
    """
    try:
        yield
    except SettingError as error:
        reason = str(error).partition(": ")[2]
        raise SettingError((*path, *error.path), reason) from None
    except ValueError as error:
        raise SettingError(path, str(error)) from None


def checked_bus(buses: Collection[str], settings: Mapping[str, Any]) -> str:
    """Return the bus name in the settings of a sending panel.

    If the settings have no bus name, the result is an empty text, which stands for the first bus.
    If the source is a log, no bus is open, and the name is not checked.

    Raises:
        SettingError: no open bus has this name.
    """
    bus = text_of(settings, "bus", "")
    if bus and buses and bus not in buses:
        raise SettingError(("bus",), f"{bus!r} is not one of {', '.join(buses)}")
    return bus
