r"""Read a TOML text to its end despite errors, with the line of each value.

The parser of the standard library stops at the first error, and does not give the line numbers of
values. The reader in this module reads statement by statement, and uses the parser of the standard
library only for scalars.

>>> document = read_toml("a = 1\n[[step]]\nsend = [\n  {x = 1},\n  {y = },\n]\n[b\n")
>>> document.values["a"], document.line_of(("step", 0, "send", 0, "x"))
(1, 4)
>>> [f"{line}: {reason}" for line, reason in document.mistakes]
["5: a value is missing before '},'", "7: ']' is missing behind b"]
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Final, NamedTuple

# The result of reading a TOML text: its values, their lines, and all errors.


class _Broken(Enum):
    """Placeholder for an invalid value, already reported."""

    BROKEN = "broken"


BROKEN: Final = _Broken.BROKEN


class Mistake(NamedTuple):
    """One syntax error in a TOML text.

    Attributes:
        line: number of the line, from 1.
        reason: text of the error for the user.
    """

    line: int
    reason: str


TomlPath = tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class TomlDocument:
    """Parsed TOML text with the line of each value, and with all its syntax errors.

    Attributes:
        values: values by key. `BROKEN` replaces each invalid value.
        lines: line of each value or table header, by its path of keys and indices.
        mistakes: syntax errors in the order of their lines.
        whole: whether all table headers could be read. If not, tables may be missing.
    """

    values: dict[str, Any]
    lines: dict[TomlPath, int]
    mistakes: tuple[Mistake, ...] = ()
    whole: bool = True

    def line_of(self, path: Sequence[str | int]) -> int:
        """Return the number of the line that contains a value.

        If this line is unknown, the result is the line of the table or array that contains the
        value.

        Args:
            path: keys and indices from the top to the value.
        """
        for end in range(len(path), 0, -1):
            if line := self.lines.get(tuple(path[:end])):
                return line
        return 1


@dataclass(slots=True, eq=False)
class _Leaf:
    """A scalar value."""

    line: int
    value: Any


@dataclass(slots=True, eq=False)
class _Array:
    """An array. It is `frozen` unless it is an array of tables with headers `[[...]]`."""

    line: int
    items: list[_Node] = field(default_factory=list)
    frozen: bool = True


@dataclass(slots=True, eq=False)
class _Table:
    """A table.

    If the table is `closed`, it accepts no second header and no dotted keys. If it is `frozen`, it
    accepts no additions.
    """

    line: int
    entries: dict[str, _Node] = field(default_factory=dict)
    closed: bool = False
    frozen: bool = False

    def below(self, line: int, key: str) -> _Table:
        """Return the table at `key`, to read a header such as `[key.b]`.

        A missing table is created. If there is an array of tables at the key, the last table of the
        array is returned.

        Raises:
            _TakenError: the key has a value that is not a table.
        """
        node = self.entries.setdefault(key, _Table(line))
        if isinstance(node, _Array) and not node.frozen:
            node = node.items[-1]
        if not isinstance(node, _Table) or node.frozen:
            raise _TakenError(key, node.line)
        return node

    def open(self, line: int, key: str) -> _Table:
        """Return the table in which the lines after a header `[key]` are stored.

        A missing table is created.

        Raises:
            _TakenError: the key already has a value or a header.
        """
        node = self.dotted(line, key)
        node.line, node.closed = line, True
        return node

    def add(self, line: int, key: str) -> _Table:
        """Append a new table to an array, for a header `[[key]]`.

        Raises:
            _TakenError: the key has a value that is not such an array.
        """
        node = self.entries.setdefault(key, _Array(line, frozen=False))
        if not isinstance(node, _Array) or node.frozen:
            raise _TakenError(key, node.line)
        node.items.append(table := _Table(line, closed=True))
        return table

    def dotted(self, line: int, key: str) -> _Table:
        """Return the table at `key`, to read a line such as `key.b = 1`.

        A missing table is created.

        Raises:
            _TakenError: the value at the key is not a table, or the header `[key]` has already
                created this table. TOML allows no such line then.
        """
        node = self.entries.setdefault(key, _Table(line))
        if not isinstance(node, _Table) or node.closed or node.frozen:
            raise _TakenError(key, node.line)
        return node


_Node = _Table | _Array | _Leaf


class _TakenError(Exception):
    """A key that exists already in another form."""

    def __init__(self, key: str, line: int) -> None:
        super().__init__(f"{key!r} stands in line {line} already")


def _document_of(top: _Table, mistakes: Iterable[Mistake], *, whole: bool) -> TomlDocument:
    """Return the document of the top table."""
    lines: dict[TomlPath, int] = {}
    values = {key: _plain(each, (key,), lines) for key, each in top.entries.items()}
    return TomlDocument(values, lines, tuple(sorted(dict.fromkeys(mistakes))), whole)


def _plain(node: _Node, path: TomlPath, lines: dict[TomlPath, int]) -> Any:
    """Return the value of a node. Record the lines of the node and of its content."""
    lines[path] = node.line
    match node:
        case _Table():
            return {key: _plain(each, (*path, key), lines) for key, each in node.entries.items()}
        case _Array():
            return [_plain(each, (*path, at), lines) for at, each in enumerate(node.items)]
    return node.value


_MOST_DEEP: Final = 50
"""Maximum depth of arrays and inline tables, and maximum number of parts of a key."""

_MOST_MISTAKES: Final = 1_000
"""Number of errors after which reading stops."""

ONE_LINE: Final = "an inline table stands on one line; [a.table] has lines of its own"

_BLANK: Final = re.compile(r"[ \t]*")
_BETWEEN: Final = re.compile(r"(?:[ \t\n]+|#[^\n]*)*")
_COMMENT: Final = re.compile(r"[ \t]*(?:#[^\n]*)?")
_CONTROL: Final = re.compile(r"[\x00-\x08\x0b-\x1f\x7f]")
_BARE: Final = re.compile(r"[A-Za-z0-9_-]+")
_QUOTED: Final = re.compile(r'"(?:[^"\\\n]|\\[^\n])*"|\'[^\'\n]*\'')
_LONG: Final = {
    '"""': re.compile(r'"""(?:[^\\]|\\.)*?""""{0,2}', re.DOTALL),
    "'''": re.compile(r"'''.*?''''{0,2}", re.DOTALL),
}
_PLAIN: Final = re.compile(r"[^\s,\[\]{}#\"']+(?: [0-9][^\s,\[\]{}#\"']*)?")
_PARTS: Final = re.compile(rf"(?<![\w\"'-])(?:[\w\"'-]++[ \t]*+\.[ \t]*+){{{_MOST_DEEP}}}[\w\"'-]")
"""Pattern of a key part, because the standard library reads keys in quadratic time."""
_WHOLE: Final = re.compile(r"0|[1-9][0-9]{0,17}")
_SIMPLE: Final = re.compile(r"\"[^\"\\]*\"|'[^']*'")
_STATEMENT: Final = re.compile(
    r"[ \t]*+(?:\[\[?[ \t]*(?!(?:true|false|inf|nan)\b)[A-Za-z_][^\]\n]*\]\]?[ \t]*(?:#|\n|$)"
    r"|[\w.\"' \t-]+=)"
)
"""Pattern of the probable start of a statement after an unfinished array."""


def load_toml(text: str) -> dict[str, Any]:
    """Parse a TOML text with the standard library, which stops at the first error.

    Args:
        text: the whole text.

    Raises:
        TOMLDecodeError: the text is invalid TOML, or is nested too deeply.
    """
    import tomllib  # noqa: PLC0415 - slow

    if found := _PARTS.search(text):
        line = text.count("\n", 0, found.start()) + 1
        reason = f"a key of more than {_MOST_DEEP} parts (at line {line}, column 1)"
        raise tomllib.TOMLDecodeError(reason)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except RecursionError:
        reason = "lists or tables nest too deep"
        raise tomllib.TOMLDecodeError(reason) from None
    except ValueError as error:  # a number of thousands of digits
        raise tomllib.TOMLDecodeError(str(error)) from None


def read_toml(text: str) -> TomlDocument:
    """Parse a TOML text.

    Args:
        text: whole text.
    """
    return _Reader(text.replace("\r\n", "\n")).read()


class _WrongError(Exception):
    """The rest of the statement cannot be read. The error may be at another place."""

    def __init__(self, at: int, reason: str, place: int | None = None) -> None:
        super().__init__(reason)
        self.at, self.place = at, at if place is None else place


class _EnoughError(Exception):
    """There are too many errors to continue."""


class _Reader:
    """A reader of one text."""

    def __init__(self, text: str) -> None:
        self._text, self._at, self._whole = text, 0, True
        self._starts = [0, *(match.end() for match in re.finditer("\n", text))]
        self._top = self._section = _Table(1)
        self._dotted: list[_Table] = []  # by keys of this section
        self._mistakes: list[Mistake] = []

    def read(self) -> TomlDocument:
        try:
            while self._skip(_BETWEEN) < len(self._text):
                start = self._at
                try:
                    self._statement()
                except _WrongError as error:
                    self._report(error.place, str(error))
                    self._go_on_behind(start, error.at)
        except _EnoughError:
            self._whole = False
        return _document_of(self._top, self._mistakes, whole=self._whole)

    def _report(self, at: int, reason: str) -> None:
        line = self._line(at)
        self._mistakes.append(Mistake(line, reason))
        if len(self._mistakes) == _MOST_MISTAKES:
            self._mistakes.append(Mistake(line, f"{_MOST_MISTAKES} mistakes; nothing more is read"))
            raise _EnoughError

    def _line(self, at: int) -> int:
        return bisect_right(self._starts, min(at, len(self._text)))

    def _go_on_behind(self, start: int, at: int) -> None:
        """Go to the line of the error if the statement started before it, or to the next line."""
        line = self._line(at)
        if at < len(self._text) and line > self._line(start):
            self._at = self._starts[line - 1]
        else:
            end = self._text.find("\n", at)
            self._at = len(self._text) if end < 0 else end

    def _skip(self, pattern: re.Pattern[str]) -> int:
        """Skip blanks, and comments that match the pattern."""
        match = pattern.match(self._text, self._at)
        if match is not None:
            for line in re.finditer(r"#[^\n]*", match[0]) if "#" in match[0] else ():
                if wrong := _CONTROL.search(line[0]):
                    self._report(match.start() + line.start(), f"a comment holds {wrong[0]!r}")
            self._at = match.end()
        return self._at

    def _is(self, signs: str) -> bool:
        return self._text.startswith(signs, self._at)

    def _rest(self) -> str:
        """Return the start of the text at the current position, for messages."""
        rest = self._text[self._at : self._at + 30].partition("\n")[0].strip()
        return repr(rest) if rest else "the end of the line"

    def _take(self, sign: str, behind: str) -> None:
        self._skip(_BLANK)
        if not self._is(sign):
            shown = behind if behind.isprintable() else ascii(behind)
            raise _WrongError(self._at, f"{sign!r} is missing behind {shown:.60}")
        self._at += len(sign)

    # Statements

    def _statement(self) -> None:
        if self._is("["):
            for table in self._dotted:
                table.closed = True
            self._dotted.clear()
            try:
                self._section = self._header()
            except _WrongError:
                self._section, self._whole = _Table(0), False
                raise
        else:
            self._key_value(self._section, self._dotted, 0)
        self._skip(_COMMENT)
        if self._at < len(self._text) and not self._is("\n"):
            raise _WrongError(self._at, f"{self._rest()} is too much here")

    def _header(self) -> _Table:
        line, many = self._line(self._at), self._is("[[")
        start, self._at = self._at, self._at + 1 + many
        self._skip(_BLANK)
        *above, last = keys = self._key()
        self._take("]]" if many else "]", ".".join(keys))
        table = self._top
        try:
            for key in above:
                table = table.below(line, key)
            return table.add(line, last) if many else table.open(line, last)
        except _TakenError as error:
            raise _WrongError(start, str(error)) from None

    def _key_value(self, table: _Table, dotted: list[_Table], depth: int) -> None:
        start, line = self._at, self._line(self._at)
        *above, last = keys = self._key()
        try:
            for key in above:
                table = table.dotted(line, key)
                dotted.append(table)
            taken = _TakenError(last, table.entries[last].line) if last in table.entries else None
        except _TakenError as error:
            table, taken = _Table(0), error
        if not taken:
            table.entries[last] = _Leaf(line, BROKEN)  # until it is read
        self._take("=", ".".join(keys))
        if taken:
            self._report(start, str(taken))
        self._skip(_BLANK)
        value = self._value(depth)
        value.line = line
        if not taken:
            table.entries[last] = value

    def _key(self) -> list[str]:
        start, keys = self._at, [self._simple_key()]
        while self._skip(_BLANK) < len(self._text) and self._is("."):
            self._at += 1
            self._skip(_BLANK)
            keys.append(self._simple_key())
        if len(keys) > _MOST_DEEP:
            raise _WrongError(start, f"a key of more than {_MOST_DEEP} parts")
        return keys

    def _simple_key(self) -> str:
        match = _BARE.match(self._text, self._at)
        if match is None and (match := _QUOTED.match(self._text, self._at)) is None:
            raise _WrongError(self._at, f"a key is expected, not {self._rest()}")
        key = match[0] if match[0][0] not in "\"'" else self._scalar(match[0])
        self._at = match.end()
        return str(key)

    # Values

    def _value(self, depth: int) -> _Node:
        start = self._at
        if self._is("[") or self._is("{"):
            if depth == _MOST_DEEP:
                raise _WrongError(start, f"nested deeper than {_MOST_DEEP}")
            self._at += 1
            return (self._array if self._text[start] == "[" else self._inline)(start, depth + 1)
        if self._is('"') or self._is("'"):
            pattern = _LONG.get(self._text[start : start + 3], _QUOTED)
            match = pattern.match(self._text, start)
            if match is None:
                raise _WrongError(start, f"the text {self._rest()} does not end")
        elif (match := _PLAIN.match(self._text, start)) is None:
            return self._missing(start, depth)
        value = self._scalar(match[0])
        self._at = match.end()
        return _Leaf(self._line(start), value)

    def _missing(self, start: int, depth: int) -> _Leaf:
        reason = f"a value is missing before {self._rest()}"
        if depth == 0 or self._text[start : start + 1] not in (",", "}"):
            raise _WrongError(start, reason)
        self._report(start, reason)
        return _Leaf(self._line(start), BROKEN)

    def _scalar(self, token: str) -> Any:
        """Return the value of a token; report an invalid one, and return BROKEN."""
        import tomllib  # noqa: PLC0415 - slow

        if _WHOLE.fullmatch(token):
            return int(token)
        if token.isprintable() and _SIMPLE.fullmatch(token):  # a parser for each takes long
            return token[1:-1]
        try:
            return tomllib.loads(f"v={token}")["v"]
        except (ValueError, RecursionError) as error:
            shown = repr(token if len(token) < 40 else f"{token[:36]}...")
            reason = re.sub(r" \(at .*\)$", "", str(error))
            if token[0] not in "\"'":
                reason = "a text stands in quotes" if token[0].isalpha() else "it is no number"
            self._report(self._at, f"{shown} is no value: {reason}")
            return BROKEN

    def _array(self, start: int, depth: int) -> _Array:
        array = _Array(self._line(start))
        while self._skip(_BETWEEN) < len(self._text) and not self._is("]"):
            self._check_unclosed(start)
            if self._is("}"):
                raise _WrongError(self._at, f"{self._rest()} is too much in the array")
            array.items.append(self._value(depth))
            self._skip(_BETWEEN)
            if self._is(","):
                self._at += 1
            elif self._at < len(self._text) and self._text[self._at] not in "]}":
                self._check_unclosed(start)
                self._report(self._at, f"',' is missing before {self._rest()}")
        self._close(start, "]", "array")
        return array

    def _check_unclosed(self, start: int) -> None:
        """Stop at the probable start of a statement, on a line after that of the array."""
        line = self._line(self._at)
        first = self._starts[line - 1]
        blank = _BLANK.match(self._text, first)
        is_first = blank is not None and blank.end() == self._at
        if is_first and line > self._line(start) and _STATEMENT.match(self._text, first):
            self._close(start, "]", "array")

    def _inline(self, start: int, depth: int) -> _Table:
        table, dotted = _Table(self._line(start), frozen=True), list[_Table]()
        broken = self._skip_in_inline(known=False)
        while not self._is("}"):
            self._key_value(table, dotted, depth)
            self._skip(_BLANK)
            if not self._is(","):
                break
            self._at += 1
            broken = self._skip_in_inline(known=broken)
            if self._is("}") and not broken:
                self._report(self._at, "',' is too much at the end of an inline table")
        for inner in dotted:
            inner.frozen = True
        self._close(start, "}", "inline table")
        return table

    def _skip_in_inline(self, *, known: bool) -> bool:
        """Skip blanks. Return whether they contained a new line.

        A new line is an error here, which is reported once.
        """
        self._skip(_BLANK)
        if not (self._is("\n") or self._is("#")):
            return known
        if not known:
            self._report(self._at, ONE_LINE)
        self._skip(_BETWEEN)
        return True

    def _close(self, start: int, sign: str, what: str) -> None:
        if not self._is(sign):
            raise _WrongError(self._at, f"{sign!r} of the {what} is missing", start)
        self._at += 1
