"""A table of a rig file while it is read: its keys by a schema, and what is wrong with them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from tickrig.emulators.testing.rig_file.fields import Field, shown
from tickrig.host.text.names import closest, near
from tickrig.host.text.toml_document import BROKEN, Mistake, TomlDocument, TomlPath

MOST: Final = 500
"""Characters of a mistake."""


class RigFileError(ValueError):
    """A rig file that cannot be used: all that is wrong with it, a line each.

    Attributes:
        file: what the file is called.
        mistakes: in the order of their lines.
    """

    def __init__(self, file: str, mistakes: tuple[Mistake, ...]) -> None:
        self.file, self.mistakes = file, mistakes
        super().__init__("\n".join(f"{file}:{line}: {reason}" for line, reason in mistakes))


@dataclass(frozen=True, slots=True)
class Key:
    """A key that a table can have.

    Attributes:
        field: takes its value.
        values: what it takes, for people.
        text: what it says, for people.
        default: what holds without it, for people; empty where it has to be there.
    """

    field: Field
    values: str
    text: str
    default: str = ""


Schema = Mapping[str, Key]
"""The keys that a table can have."""


@dataclass(slots=True)
class Notes:
    """What is wrong with a document.

    Attributes:
        document: as it was read.
        mistakes: so far.
        names: of values that the file calls otherwise; empty where it is a rig file.
    """

    document: TomlDocument
    mistakes: list[Mistake] = field(default_factory=list)
    names: Mapping[TomlPath, str] = field(default_factory=dict)

    def wrong(self, keys: TomlPath, reason: str) -> None:
        """Note what is wrong with the value at these keys."""
        line = self.document.line_of(keys)
        self.mistakes.append(Mistake(line, f"{self.place(keys)}{' '.join(reason.split())}"))

    def place(self, keys: TomlPath) -> str:
        """Return how a mistake begins: with the keys as the file has them."""
        return f"{self.names.get(keys) or dotted(keys)}: " if keys else ""

    @property
    def all(self) -> tuple[Mistake, ...]:
        """All mistakes by their lines, none of them twice, as they can be shown."""
        found = {*self.document.mistakes, *self.mistakes}
        return tuple(sorted(Mistake(line, printable(reason)) for line, reason in found))


@dataclass(frozen=True, slots=True)
class Section:
    """A table.

    Attributes:
        notes: of the whole document.
        keys: its own, from the top.
        values: what it holds.
    """

    notes: Notes
    keys: TomlPath
    values: dict[str, Any]

    def wrong(self, reason: str, *keys: str | int) -> None:
        """Note what is wrong with the table, or with the value at keys in it."""
        self.notes.wrong((*self.keys, *keys), reason)

    def unknown(self, reason: str, *keys: str | int) -> None:
        """Note that something is named which is not there, unless its table may be unread."""
        if self.notes.document.whole:
            self.wrong(reason, *keys)

    def read(self, schema: Schema, *others: str) -> dict[str, Any]:
        """Take the values that the schema names; a wrong one is noted, and left out.

        Args:
            schema: the keys.
            others: keys that somebody else reads.
        """
        found: dict[str, Any] = {}
        for key, value in self.values.items():
            if key in others or is_broken(value):
                continue
            if key not in schema:
                self.no_key(key, [*schema, *others])
                continue
            try:
                found[key] = schema[key].field(value)
            except ValueError as error:
                self.wrong(str(error), key)
        meant = {each for key in self.values if key not in schema for each in closest(key, schema)}
        for key, each in schema.items():
            if not each.default and key not in self.values and key not in meant:
                self.wrong(f"no key {key!r}: {each.text}, {each.values}")
        return found

    def no_key(self, key: str, known: Iterable[str]) -> None:
        """Note a key that the table cannot have, in its own line."""
        line = self.notes.document.line_of((*self.keys, key))
        reason = f"no key {key!r}; {near(key, list(dict.fromkeys(known)))}"
        self.notes.mistakes.append(Mistake(line, f"{self.notes.place(self.keys)}{reason}"))

    def sub(self, key: str) -> Section | None:
        """Return the table of a key; None if there is none, or something else, which is noted."""
        value = self.values.get(key)
        if value is None or value is BROKEN:
            return None
        if isinstance(value, dict):
            return Section(self.notes, (*self.keys, key), value)
        self.wrong(f"it is a table [{dotted((*self.keys, key))}], not {shown(value)}", key)
        return None

    def subs(self, *but: str) -> Iterator[tuple[str, Section | None]]:
        """Yield all keys but some, each with its table."""
        for key in self.values:
            if key not in but:
                yield key, self.sub(key)


def is_broken(value: object) -> bool:
    """Return whether a value, or a part of it, is no TOML: that is noted already."""
    match value:
        case dict():
            return any(map(is_broken, value.values()))
        case list():
            return any(map(is_broken, value))
    return value is BROKEN


def printable(text: str) -> str:
    r"""Escape what no terminal shows, and let it be no longer than a few lines.

    >>> printable("us\ufeffd")
    'us\\ufeffd'
    """
    if not text.isprintable():
        text = "".join(each if each.isprintable() else ascii(each)[1:-1] for each in text)
    return text if len(text) <= MOST else f"{text[: MOST - 3]}..."


def dotted(keys: TomlPath) -> str:
    """Write keys as TOML does; indices count from 1.

    >>> dotted(("device", "left", "start", "0x6000:1", 0))
    'device.left.start."0x6000:1"[1]'
    """
    out = ""
    for key in keys:
        if isinstance(key, int):
            out += f"[{key + 1}]"
            continue
        bare = key and all(sign.isascii() and (sign.isalnum() or sign in "_-") for sign in key)
        shortened = key if len(key) <= 40 else f"{key[:37]}..."
        quoted = '"' + "".join(s if s.isprintable() else "?" for s in shortened) + '"'
        out += f"{'.' if out else ''}{shortened if bare else quoted}"
    return out
