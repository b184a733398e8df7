"""The workspace: one TOML file for the settings of all panels.

It is read whole and written whole, by way of a file beside it, so that no half
of it is ever there. What nobody here knows stays in it, comments too. A file
that somebody else has changed meanwhile is left alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tickrig.host.text.toml_reader import read_toml
from tickrig.host.text.whole_file import write_whole

if TYPE_CHECKING:
    from tomlkit import TOMLDocument
    from tomlkit.container import Container
    from tomlkit.items import Table


MOST: Final = 200_000
"""Characters; tomlkit takes the square of it."""


class SettingError(ValueError):
    """A setting that is none.

    Attributes:
        path: keys and indices to it, below the panel's own table.
    """

    def __init__(self, path: Sequence[str | int], reason: str) -> None:
        super().__init__(f"{'.'.join(map(str, path))}: {reason}")
        self.path = tuple(path)


class WorkspaceError(ValueError):
    """A file that cannot be used or written; one line, with its name."""


class Workspace:
    """Settings by section.

    Args:
        text: as it stands in the file.
        path: the file; None for settings that are kept nowhere.

    Raises:
        WorkspaceError: no TOML; says the line. Or tomlkit is not there.
    """

    def __init__(self, text: str = "", path: Path | None = None) -> None:
        try:
            import tomlkit  # noqa: PLC0415 - an extra
            from tomlkit.exceptions import ParseError, TOMLKitError  # noqa: PLC0415
        except ImportError as error:
            raise WorkspaceError("workspaces need tomlkit: pip install 'tickrig[tui]'") from error
        self.path, self._text = path, text
        if len(text) > MOST:
            raise WorkspaceError(f"{path}: more than {MOST:,} characters: no workspace")
        try:
            self._document: TOMLDocument = tomlkit.parse(text)
            self._document.unwrap()  # some tables that are there twice are found by it alone
        except ParseError as error:
            raise WorkspaceError(f"{path}, line {error.line}: {_reason(error)}") from None
        except TOMLKitError as error:
            raise WorkspaceError(f"{path}: {_reason(error)}") from None

    @classmethod
    def read(cls, path: Path) -> Workspace:
        """Read a file; one that is not there yet is an empty workspace.

        Raises:
            WorkspaceError: it cannot be read, or is no TOML.
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
        """Return the settings of a section; empty if it is not there.

        Raises:
            WorkspaceError: it is no table.
        """
        found = self._document.unwrap().get(name, {})
        if not isinstance(found, dict):
            raise self.wrong(SettingError((name,), "is no table"))
        return found

    def wrong(self, error: SettingError, section: str = "") -> WorkspaceError:
        """Return the error of a setting with the line it stands on."""
        path = (section, *error.path) if section else error.path
        place = read_toml(self._text).line_of(path)
        name = f"{section}.{error}" if section else str(error)
        return WorkspaceError(f"{self.path}, line {place}: {name}")

    def put(self, name: str, settings: Mapping[str, Any]) -> None:
        """Set the settings of a section; a key that is None is taken out, other keys stay."""
        if settings:
            _merge(self._document, {name: settings})

    @property
    def text(self) -> str:
        """All of it, as it would be written."""
        return self._document.as_string()

    def write(self, *, over: bool = False) -> bool:
        """Write the file if anything has changed; return whether it has.

        Args:
            over: whatever is in the file now.

        Raises:
            WorkspaceError: it cannot be written, or is not as it was last read or written.
        """
        text, path = self.text, self.path
        if path is None or (text == self._text and not over):
            return False
        try:
            if not over and self._differs(path):
                raise WorkspaceError(f"{path} was changed by somebody else: not saved")
            write_whole(path, text)
        except OSError as error:
            raise WorkspaceError(f"{path}: {error.strerror}: not saved") from None
        self._text = text
        return True

    def _differs(self, path: Path) -> bool:
        """Say whether a file is not as it was last read or written."""
        try:
            return path.read_bytes() != self._text.encode()
        except FileNotFoundError:
            return False


def _reason(error: Exception) -> str:
    return str(error).split(" at line ")[0]


def _merge(table: Container | Table | Any, settings: Mapping[str, Any]) -> None:
    """Set what differs; tables and arrays of tables are gone through key by key."""
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
    """Return a setting without what is None in it."""
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
