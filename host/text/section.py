"""A table of a user's file while the file is read, with its fields and their errors.

A taker converts a value of the file, or raises ValueError with the allowed values.

>>> whole(1, 127)(5), duration("500ms")
(5, 500000)
"""

# How a user's file is read
# -------------------------
# A reader of a file reports all its mistakes at once, each with the line of the value or key that
# is wrong. Three steps make that possible, and each of them goes on after a mistake:
#
#   text  -> tree     `toml_reader.read_toml` and `yaml_reader.read_yaml` parse the whole text. A
#                     broken value becomes BROKEN in TOML, and the statement after it is read. Both
#                     know the line of each value: TOML by path, YAML in the items of its tree.
#   tree  -> values   `Section.read(schema)` takes the values of one table. A `Field` says what its
#                     value is: the taker raises ValueError with what it takes instead, and the
#                     section notes that at the path of the value. A wrong value is left out, so
#                     readers ask `"key" in values`, and use the default if it is missing.
#   values -> objects The reader of the file makes its own objects, and notes what is wrong
#                     between them by `Section.wrong`. It looks at `Notes.all` last, and raises.
#
# What follows from a mistake is no second mistake:
#   - BROKEN is noted by the parser; `is_broken` lets a reader skip it without a word.
#   - A needed key is not missing if an unknown key is near to it: it is misspelt (`Section.read`).
#   - A header that cannot be read may have been a table that others name: then `document.whole` is
#     false, and `Section.unknown` does not report names that are not there.
#   - `Notes.all` sorts by line and drops equal mistakes, for two readers may look at one value.
#
# Messages: `Notes.place` writes the path as TOML does (`device.left.start[1]`, indices from 1), the
# taker the rest ("it takes a number 0..1, not 'x'"). `Field.values` and `Field.text` are what a
# missing key reports and what the tables of the pages show, so both cannot differ from the code.
#
# A bus.yml is read by `host.canopen.bus_file.notes.BusFileSection` instead: dcfgen, cogen and the
# container of ros2_canopen define what a value means there, and each mistake breaks a rule of them.

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Any, Final

from tickrig.host.text.names import closest, near
from tickrig.host.text.toml_reader import BROKEN, Mistake, TomlDocument, TomlPath, read_toml
from tickrig.host.text.values import counted, parse_size, us_of

_Taker = Callable[[Any], Any]
"""Function that converts a TOML value, or raises ValueError with the allowed values."""

_LONGEST: Final = 60


def shown(value: object) -> str:
    """Describe a TOML value in one short line.

    >>> shown(True), shown({"a": 1}), shown("x")
    ('true', 'a table', "'x'")
    """
    match value:
        case bool():
            return str(value).lower()
        case dict():
            return "a table"
        case list():
            return "a list"
    if hasattr(value, "isoformat"):  # a date or a time
        return str(value.isoformat())
    text = f"{value!r:.{_LONGEST + 1}}" if isinstance(value, str) else str(value)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


def anything(value: Any) -> Any:
    """Accept any value. `Section.sub` or `Section.tables` checks it later."""
    return value


def matching(accepts: Callable[[str], object], what: str) -> _Taker:
    """Return a converter for a TOML field that accepts only texts for which `accepts` is true.

    Args:
        accepts: function that returns whether a text is valid.
        what: description of the valid texts. The error message for an invalid value contains it.
    """

    def take(value: object) -> str:
        if isinstance(value, str) and accepts(value):
            return value
        raise ValueError(f"it takes {what}, not {shown(value)}")

    return take


text: Final = matching(bool, "a text")
"""Accept a text that is not empty."""

string: Final = matching(lambda _: True, "a text")
"""Accept a text, which may be empty."""

path: Final = matching(lambda name: name and "\0" not in name, "the name of a file")
"""Accept the name of a file."""


def texts(value: object) -> tuple[str, ...]:
    """Accept a text or a list of texts."""
    values = value if isinstance(value, list) else [value]
    if values and all(isinstance(each, str) and each for each in values):
        return tuple(values)
    raise ValueError(f"it takes a text or a list of texts, not {shown(value)}")


def command(value: object) -> tuple[str, ...]:
    """Convert the value of a TOML field to the words of a command line.

    The value is a list of words, or one text that is split as in a shell.
    """
    if isinstance(value, list):
        return texts(value)
    try:
        if words := shlex.split(text(value)):
            return tuple(words)
    except ValueError as error:
        if isinstance(value, str) and value:
            raise ValueError(f"{shown(value)}: {str(error).lower()}") from None
    raise ValueError(f"it takes a command line, not {shown(value)}")


def flag(value: object) -> bool:
    """Accept true or false."""
    if isinstance(value, bool):
        return value
    raise ValueError(f"it takes true or false, not {shown(value)}")


def table(value: object) -> dict[str, Any]:
    """Accept a table."""
    if isinstance(value, dict):
        return value
    raise ValueError(f"it takes a table, not {shown(value)}")


def lines(value: object) -> dict[str, str]:
    """Accept a table of texts by name."""
    if isinstance(value, dict) and all(isinstance(each, str) for each in value.values()):
        return value
    raise ValueError(f'it takes lines like name = "value", not {shown(value)}')


def whole(low: int, high: int) -> _Taker:
    """Return a function that accepts whole numbers in a range."""

    def take(value: object) -> int:
        if isinstance(value, int) and not isinstance(value, bool) and low <= value <= high:
            return value
        raise ValueError(f"it takes a whole number {low}..{high}, not {shown(value)}")

    return take


def number(low: float, high: float, *, above: bool = False) -> _Taker:
    """Return a function that accepts numbers in a range. `above` excludes the lower end."""
    allowed = f"above {low:g} and up to {high:g}" if above else f"{low:g}..{high:g}"

    def take(value: object) -> float:
        fits = isinstance(value, int | float) and not isinstance(value, bool)
        fits = fits and low <= value <= high and isfinite(value)  # type: ignore[operator,arg-type]
        if fits and not (above and value == low):
            return value  # type: ignore[return-value]
        raise ValueError(f"it takes a number {allowed}, not {shown(value)}")

    return take


def one_of(*names: str) -> _Taker:
    """Return a function that accepts one of several words."""

    def take(value: object) -> str:
        if isinstance(value, str) and value in names:
            return value
        close = isinstance(value, str) and closest(value, names)
        hint = f"; did you mean {close[0]!r}?" if close else ""
        raise ValueError(f"it takes {', '.join(names)}, not {shown(value)}{hint}")

    return take


def duration(value: object) -> int:
    """Accept a time as text, at least 1 us. Return microseconds."""
    if isinstance(value, str) and (duration_us := us_of(value)):
        return duration_us
    raise ValueError(f'it takes a time as "500ms", above 0, not {shown(value)}')


def size(value: object) -> int:
    """Accept a number of bytes, or a text such as `64k`."""
    if isinstance(value, int) and not isinstance(value, bool) and value >= 0:
        return value
    if isinstance(value, str):
        return parse_size(value)
    raise ValueError(f'it takes bytes as 4096 or "64k", not {shown(value)}')


_MOST: Final = 500
"""Maximum number of characters of an error."""


@dataclass(frozen=True, slots=True)
class Field:
    """Definition of a key in a TOML file of the user: how its value is converted and described.

    Attributes:
        field: function that checks the value of the key and converts it.
        values: description of the allowed values, for the user.
        text: description of the key, for the user.
        default: default value as text for the user, empty if the key is required.
    """

    field: _Taker
    values: str
    text: str
    default: str = ""


Schema = Mapping[str, Field]
"""Fields of a table by key."""


def rows(schema: Schema) -> Iterator[str]:
    """Yield the lines of a Markdown table that documents the keys of a schema."""
    yield "| key | value | unless given | meaning |"
    yield "|---|---|---|---|"
    for name, key in schema.items():
        yield f"| `{name}` | {key.values} | {key.default or 'needed'} | {key.text} |"


@dataclass(slots=True)
class Notes:
    """Collector of the errors in a TOML file of the user.

    Attributes:
        document: parsed file, which gives the line of each value.
        mistakes: errors found until now.
        names: texts that replace keys in error messages, by path of the key. Other keys are shown
            as in the file.
    """

    document: TomlDocument
    mistakes: list[Mistake] = field(default_factory=list)
    names: Mapping[TomlPath, str] = field(default_factory=dict)

    def wrong(self, keys: TomlPath, reason: str) -> None:
        """Add an error about the value at the given keys."""
        line = self.document.line_of(keys)
        self.mistakes.append(Mistake(line, f"{self.place(keys)}{' '.join(reason.split())}"))

    def place(self, keys: TomlPath) -> str:
        """Return the beginning of an error message: the keys of the invalid value, and a colon.

        Example: `step[1].send:`. If `names` contains a text for the keys, this text replaces them.
        """
        return f"{self.names.get(keys) or _dotted(keys)}: " if keys else ""

    @property
    def all(self) -> tuple[Mistake, ...]:
        """All errors by line, without duplicates, in printable form."""
        found = {*self.document.mistakes, *self.mistakes}
        return tuple(sorted(Mistake(line, _printable(reason)) for line, reason in found))


@dataclass(frozen=True, slots=True)
class Section:
    """A table of a TOML file of the user, whose methods convert values and report errors.

    Attributes:
        notes: collector of the errors in the whole file.
        keys: keys from the top of the file to the table.
        values: values of the table by key.
    """

    notes: Notes
    keys: TomlPath
    values: dict[str, Any]

    def wrong(self, reason: str, *keys: str | int) -> None:
        """Report an error in this table, or in the value at the given keys below it.

        Args:
            reason: text of the error for the user.
            keys: keys from this table to the value.
        """
        self.notes.wrong((*self.keys, *keys), reason)

    def unknown(self, reason: str, *keys: str | int) -> None:
        """Report an unknown name, unless the document has tables that could not be read."""
        if self.notes.document.whole:
            self.wrong(reason, *keys)

    def read(self, schema: Schema, *others: str) -> dict[str, Any]:
        """Convert the values of the table and return them by key. Report and omit invalid ones.

        Args:
            schema: definition of each key.
            others: keys that other code reads, which are not reported as unknown.
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
        missing = [key for key, each in schema.items() if not each.default]
        if missing := [key for key in missing if key not in self.values]:
            unknown = [key for key in self.values if key not in schema]
            meant = {each for key in unknown for each in closest(key, schema)}
            for key in missing:
                if key not in meant:
                    self.wrong(f"no key {key!r}: {schema[key].text}, {schema[key].values}")
        return found

    def no_key(self, key: str, known: Iterable[str]) -> None:
        """Add an error for an unknown key, in the line of the key."""
        line = self.notes.document.line_of((*self.keys, key))
        reason = f"no key {key!r}; {near(key, list(dict.fromkeys(known)))}"
        self.notes.mistakes.append(Mistake(line, f"{self.notes.place(self.keys)}{reason}"))

    def sub(self, key: str) -> Section | None:
        """Return the table of a key, or None if the key is missing.

        If the value is not a table, it is reported as an error, and the result is also None.
        """
        value = self.values.get(key)
        if value is None or value is BROKEN:
            return None
        if isinstance(value, dict):
            return Section(self.notes, (*self.keys, key), value)
        self.wrong(f"it is a table [{_dotted((*self.keys, key))}], not {shown(value)}", key)
        return None

    def tables(self, key: str) -> list[Section]:
        """Return the tables `[[key]]`. Report other values."""
        value = self.values.get(key, [])
        if value is BROKEN:
            return []
        header = _dotted((*self.keys, key))
        if not isinstance(value, list):
            given = f"[{header}]" if isinstance(value, dict) else shown(value)
            self.wrong(f"it is a table [[{header}]], not {given}", key)
            return []
        for at, each in enumerate(value):
            if not isinstance(each, dict) and each is not BROKEN:
                self.wrong(f"it is a table [[{header}]], not {shown(each)}", key, at)
        return [
            Section(self.notes, (*self.keys, key, at), each)
            for at, each in enumerate(value)
            if isinstance(each, dict)
        ]

    def subs(self, *but: str) -> Iterator[tuple[str, Section | None]]:
        """Yield each key with its table, except for the keys in `but`."""
        for key in self.values:
            if key not in but:
                yield key, self.sub(key)


def read_section(text: str) -> Section:
    """Parse a TOML text and return its top table. Syntax errors are collected in its `notes`."""
    document = read_toml(text)
    return Section(Notes(document), (), document.values)


def in_a_line(mistakes: Sequence[Mistake]) -> str:
    """Describe the first error, and count the others, in one line.

    >>> in_a_line([Mistake(3, "no key 'a'"), Mistake(4, "no key 'b'")])
    "line 3: no key 'a' (and 1 mistake more)"
    """
    line, reason = mistakes[0]
    more = f" (and {counted(len(mistakes) - 1, 'mistake')} more)" if len(mistakes) > 1 else ""
    return f"line {line}: {reason}{more}"


def is_broken(value: object) -> bool:
    """Return whether a value contains invalid TOML. Such a value has been reported already."""
    match value:
        case dict():
            return any(map(is_broken, value.values()))
        case list():
            return any(map(is_broken, value))
    return value is BROKEN


def _printable(text: str) -> str:
    r"""Escape unprintable characters, and shorten the text to a few lines.

    >>> _printable("us\ufeffd")
    'us\\ufeffd'
    """
    if not text.isprintable():
        text = "".join(each if each.isprintable() else ascii(each)[1:-1] for each in text)
    return text if len(text) <= _MOST else f"{text[: _MOST - 3]}..."


def _dotted(keys: TomlPath) -> str:
    """Return keys in the notation of TOML. Indices count from 1.

    >>> _dotted(("device", "left", "start", "0x6000:1", 0))
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
