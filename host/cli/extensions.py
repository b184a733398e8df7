"""Extensions in installed packages, which are entry points (docs/howto/extending.md)."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from tickrig.host.text.names import near
from tickrig.host.text.user_file import explain_error

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")


class ExtensionError(ValueError):
    """An extension is missing or unusable. The message is one line."""


@dataclass(frozen=True)
class ExtensionGroup(Generic[T]):
    """A group of extensions, such as device types: built-in ones, and ones of other packages.

    Other packages register their extensions as entry points. No module is imported, and no metadata
    is read, before the first access. A built-in extension needs no installation, and an entry point
    of the same name does not replace it.

    Args:
        name: name of the entry point group, such as `tickrig.devices`.
        what: noun for an extension in messages, such as `device`.
        built_in: built-in extensions by name, each in the form `MODULE:NAME`.
        accepts: function that returns whether an object is a valid extension of this group.
        wanted: description of a valid extension for messages, such as `a DeviceType`.
    """

    name: str
    what: str
    built_in: Mapping[str, str]
    accepts: Callable[[Any], bool]
    wanted: str

    def names(self) -> list[str]:
        """Return all names without loading anything. Built-in names are first."""
        return [*self.built_in, *sorted({point.name for point in self._foreign()})]

    def load(self, name: str) -> T:
        """Import the extension that has the given name, and return it.

        Raises:
            ExtensionError: there is no extension of this name, or it cannot be loaded.
        """
        if name in self.built_in:
            return self._checked(f"{self.what} {name!r}", self.built_in[name])
        for point in self._foreign():
            if point.name == name:
                return self._load_foreign(point)
        raise ExtensionError(f"no {self.what} {name!r}; {near(name, self.names())}")

    def load_all(self, notify: Callable[[str], None]) -> dict[str, T]:
        """Import all extensions of this group, and return them by name.

        An extension that cannot be loaded is left out and reported.

        Args:
            notify: function that is called with a message about each such extension.
        """
        return {name: self.load(name) for name in self.built_in} | self.load_foreign(notify)

    def load_foreign(self, notify: Callable[[str], None]) -> dict[str, T]:
        """Import the extensions of other packages, and return them by name.

        An extension that cannot be loaded is left out and reported.

        Args:
            notify: function that is called with a message about each such extension.
        """
        members = dict[str, T]()
        for point in self._foreign():
            try:
                members.setdefault(point.name, self._load_foreign(point))
            except ExtensionError as error:
                notify(str(error))
        return members

    def _foreign(self) -> Iterator[EntryPoint]:
        """Yield the entry points of other packages."""
        from importlib.metadata import entry_points  # noqa: PLC0415 - slow

        seen = set[tuple[str, str]]()  # a package may be found twice on the path
        for point in entry_points(group=self.name):
            if point.name not in self.built_in and (point.name, point.value) not in seen:
                seen.add((point.name, point.value))
                yield point

    def _load_foreign(self, point: EntryPoint) -> T:
        package = point.dist.name if point.dist else "?"
        return self._checked(f"{self.what} {point.name!r} of package {package}", point.value)

    def _checked(self, place: str, path: str) -> T:
        value = path.partition("[")[0].strip()
        module, _, attribute = value.partition(":")
        try:
            if module in sys.modules:
                found: T = getattr(sys.modules[module], attribute)
            else:
                from tickrig.host.cli.start import load  # noqa: PLC0415 - slow, often not needed

                found = load(value)
        except (Exception, SystemExit) as error:  # a foreign module may raise anything
            raise ExtensionError(f"{place} ({path}): {explain_error(error)}") from error
        if not self.accepts(found):
            raise ExtensionError(f"{place} ({path}) is not {self.wanted}")
        if isinstance(name := getattr(found, "name", None), str) and repr(name) not in place:
            raise ExtensionError(f"{place} ({path}) calls itself {name!r}")
        return found
