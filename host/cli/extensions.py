"""Extensions in installed packages, which are entry points (docs/howto/extending.md)."""

from __future__ import annotations

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
    """One group of entry points, with built-in members and members of other packages.

    No module is imported, and no metadata is read, before the first access. Built-in members need
    no installation. An entry point with the name of a built-in member does not replace that member.

    Args:
        name: name of the group, such as `tickrig.devices`.
        what: noun for the members in messages, such as `device`.
        built_in: built-in members by name, in the form `MODULE:NAME`.
        accepts: function that returns whether an object may be a member.
        wanted: description of members, such as `a DeviceType`.
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
        """Return the member with a name.

        Raises:
            ExtensionError: the name is unknown, or the member cannot be loaded.
        """
        if name in self.built_in:
            return self._checked(f"{self.what} {name!r}", self.built_in[name])
        for point in self._foreign():
            if point.name == name:
                return self._load_foreign(point)
        raise ExtensionError(f"no {self.what} {name!r}; {near(name, self.names())}")

    def load_all(self, notify: Callable[[str], None]) -> dict[str, T]:
        """Return all members by name. Omit and report members that cannot be loaded.

        Args:
            notify: function that is called with each report.
        """
        return {name: self.load(name) for name in self.built_in} | self.load_foreign(notify)

    def load_foreign(self, notify: Callable[[str], None]) -> dict[str, T]:
        """Return the members of other packages by name.

        Members that cannot be loaded are omitted and reported.
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
        from tickrig.host.cli.start import load  # noqa: PLC0415 - slow, and often not needed

        try:
            found: T = load(path.partition("[")[0].strip())
        except (Exception, SystemExit) as error:  # a foreign module may raise anything
            raise ExtensionError(f"{place} ({path}): {explain_error(error)}") from error
        if not self.accepts(found):
            raise ExtensionError(f"{place} ({path}) is not {self.wanted}")
        if isinstance(name := getattr(found, "name", None), str) and repr(name) not in place:
            raise ExtensionError(f"{place} ({path}) calls itself {name!r}")
        return found
