"""Reports in files: the page, and the JSON from which the page can be made later.

Workers pass their reports as JSON, and reports of several runs are merged from JSON.

>>> from tickrig.emulators.testing.report.bench_report import Outcome, TestRecord
>>> data = to_data(TestRecord("test_a.py::test_a", Outcome.PASSED, virtual_us=1_000))
>>> from_data(TestRecord, data).virtual_us
1000
"""

from __future__ import annotations

import gc
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, asdict, fields, is_dataclass, replace
from enum import Enum
from functools import cache, partial
from importlib.util import find_spec
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TextIO, TypeVar, get_args, get_origin, get_type_hints

from tickrig._lazy import LazyModule
from tickrig.emulators.testing.report.bench_report import BenchReport, TestRecord
from tickrig.host.text.whole_file import check_file, is_special, write_whole

if TYPE_CHECKING:
    from tickrig.emulators.testing.report import page
else:
    page = LazyModule("tickrig.emulators.testing.report.page")  # Jinja2, an extra

_VERSION_KEY: Final = "tickrig-report"

_MOST: Final = 2**63 - 1
"""Limit of integers; as a time in microseconds it is 292,000 years."""

_MOST_SHARED: Final = 50_000
"""Number of values of a column that are stored before the store is emptied."""

_T = TypeVar("_T")

_Reader = Callable[[Any], Any]
"""Function that converts a JSON value to a value of a report."""

_NAMES: Final[Mapping[type, str]] = {
    int: "a whole number",
    float: "a number",
    bool: "true or false",
    str: "a text",
    type(None): "null",
}


class ReportError(ValueError):
    """Raised if JSON is not a bench report of this version; the message names the wrong part."""


def to_data(value: Any) -> Any:  # what a value holds is open
    """Return a value of a report as dicts, lists, texts and numbers for JSON."""
    return asdict(value)


def from_data(kind: type[_T], data: object) -> _T:
    """Convert the result of `to_data` back to the value of a bench report.

    Args:
        kind: type of the value: `BenchReport`, `TestRecord`, ...
        data: dicts, lists, texts and numbers.

    Raises:
        ReportError: a key or value is invalid.
    """
    hint: Any = kind
    value: _T = _reader(hint)(data)
    return value


_VERSION: Final = 1
"""Version of the JSON form; it changes when a field is removed or gets another meaning."""


def to_json(report: BenchReport) -> str:
    """Return a report as JSON on one line."""
    data = {_VERSION_KEY: _VERSION, **_values(report)}
    return json.dumps(data, separators=(",", ":"), default=_values)


def _values(value: Any) -> dict[str, Any]:
    return {field.name: getattr(value, field.name) for field in fields(value)}


def from_json(text: str) -> BenchReport:
    """Return a bench report from its JSON text.

    Raises:
        ReportError: the text is not JSON, not a report, a report of another version, or has an
            invalid value.
    """
    return _read(StringIO(text))


def _read(file: TextIO) -> BenchReport:
    collects = gc.isenabled()
    gc.disable()  # nothing of a report is garbage: looking for some takes half of the time
    try:
        report = _written_by_us(_Scanner(file))
    except (ValueError, RecursionError):
        report = None  # errors are reported below
    finally:
        if collects:
            gc.enable()
    if report is None:
        file.seek(0)
        return _any_json(file.read())
    return report


_PIECE: Final = 1 << 20
"""Number of characters that are read at a time."""


class _Scanner:
    """Reads values and punctuation of JSON, with only a part of the file in memory.

    Args:
        file: the JSON, without blanks between values.
    """

    def __init__(self, file: TextIO) -> None:
        self._file, self._text, self._at = file, "", 0
        self._scan = json.JSONDecoder().raw_decode

    @property
    def mark(self) -> str:
        """The next character, or "" at the end."""
        if self._at == len(self._text):
            self._read_on()
        return self._text[self._at : self._at + 1]

    @property
    def rest(self) -> str:
        """The rest of the file."""
        return self._text[self._at :] + self._file.read()

    def skip(self) -> None:
        """Skip the next character."""
        self._at += 1

    def value(self) -> Any:
        """Return the next JSON value of the file; raise ValueError if there is none.

        The next call continues behind this value.
        """
        while True:
            try:
                found, end = self._scan(self._text, self._at)
            except ValueError:
                if not self._read_on():
                    raise
                continue
            if end < len(self._text) or not self._read_on():  # else a number may go on
                self._at = end
                return found

    def _read_on(self) -> bool:
        """Read more of the file, at least as much as is in memory; return False at the end."""
        self._text, self._at = self._text[self._at :], 0
        more = self._file.read(max(_PIECE, len(self._text)))
        self._text += more
        return bool(more)


def _written_by_us(json_: _Scanner) -> BenchReport | None:
    """Read a report test by test; the JSON of a test is released before the next one is read.

    Reading test by test takes half of the time and a quarter of the memory of reading the report at
    once.

    Returns:
        The report, or None if its form differs from the output of `to_json`.
    """
    data, read, tests = dict[str, Any](), _reader(TestRecord), list[TestRecord]()
    opening = "{"
    while json_.mark == opening:
        opening = ","
        json_.skip()
        key = json_.value()
        if type(key) is not str or key in data or json_.mark != ":":
            return None
        json_.skip()
        if key != "tests" or json_.mark != "[":
            data[key] = json_.value()
            continue
        data[key], bracket = (), "["
        while json_.mark == bracket:
            bracket = ","
            json_.skip()
            if json_.mark == "]" and not tests:
                break
            tests.append(read(json_.value()))
        if json_.mark != "]":
            return None
        json_.skip()
    if json_.mark != "}":
        return None
    json_.skip()
    if json_.rest.strip(" \t\r\n") or data.pop(_VERSION_KEY, None) != _VERSION:
        return None
    return replace(from_data(BenchReport, data), tests=tuple(tests))


def _any_json(text: str) -> BenchReport:
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ReportError(f"not JSON: {error}") from None
    if not isinstance(data, dict) or _VERSION_KEY not in data:
        raise ReportError(f"no report: there is no key {_VERSION_KEY!r}")
    version = data.pop(_VERSION_KEY)
    if version != _VERSION:
        raise ReportError(f"report version {version!r:.20}; this program reads {_VERSION}")
    return from_data(BenchReport, data)


@cache
def _reader(hint: Any) -> _Reader:
    """Return the reader for the type of a field."""
    if get_origin(hint) is tuple:
        return _tuple_reader(get_args(hint))
    if isinstance(hint, type) and is_dataclass(hint):
        return _fields_reader(hint)
    if isinstance(hint, type) and issubclass(hint, Enum):
        return _enum_reader(hint)
    if isinstance(hint, type) and issubclass(hint, tuple):
        values = _tuple_reader(_members(hint))
        return lambda data: hint(*values(data))
    return _plain_reader(get_args(hint) or (hint,))


def _members(hint: Any) -> tuple[Any, ...]:
    """Return the types of the members of a tuple."""
    if get_origin(hint) is tuple:
        return get_args(hint)
    named = isinstance(hint, type) and issubclass(hint, tuple)
    return tuple(get_type_hints(hint).values()) if named else ()


def _allowed(kinds: tuple[type, ...]) -> frozenset[type]:
    return frozenset({*kinds, int} if float in kinds else kinds)


def _rows_reader(hint: Any, each: _Reader) -> _Reader:
    """Return a function that reads many tuples of plain values, column by column.

    The function takes a tenth of the time of reading value by value. Equal values in a list or in
    later lists are stored once, because times and samples of tests are similar. Otherwise ten
    thousand tests would take twice the memory.

    Args:
        hint: type of a tuple.
        each: function that reads a single tuple, and that explains an error in the tuple.
    """
    allowed = [_allowed(get_args(member) or (member,)) for member in _members(hint)]
    make: Any = tuple if get_origin(hint) is tuple else partial(tuple.__new__, hint)
    known: dict[type, dict[Any, Any]] = {int: {}, float: {}, str: {}}

    def read(data: Any) -> Iterable[Any]:
        if {*map(type, data)} != {list} or {*map(len, data)} != {len(allowed)}:
            return map(each, data)
        columns: list[Iterable[Any]] = []
        for column, kinds in zip(zip(*data, strict=True), allowed, strict=True):
            found = {*map(type, column)}
            if not found <= kinds:
                return map(each, data)
            if int in found:
                numbers = [one for one in column if type(one) is int] if found != {int} else column
                if min(numbers) < -_MOST or max(numbers) > _MOST:
                    return map(each, data)
            if len(found) == 1 and found <= known.keys():
                once = known[next(iter(found))]
                if len(once) > _MOST_SHARED:
                    once.clear()
                if found == {float}:
                    fresh = {*column} - once.keys()
                    once.update(zip(fresh, fresh, strict=True))
                    once.pop(0.0, None)  # it would stand for -0.0 too
                    columns.append(map(once.get, column, column))
                else:
                    columns.append(map(once.setdefault, column, column))
            else:
                columns.append(column)
        return map(make, zip(*columns, strict=True))

    return read


def _plain_reader(kinds: tuple[type, ...]) -> _Reader:
    allowed = _allowed(kinds)
    names = " or ".join(_NAMES[kind] for kind in kinds if not (kind is int and float in kinds))

    def read(data: Any) -> Any:
        if type(data) not in allowed:  # bool is an int
            raise ReportError(f": {data!r:.40} is not {names}")
        if type(data) is int and not -_MOST <= data <= _MOST:
            raise ReportError(f": a number of {data.bit_length()} bits is too large")
        return data

    return read


def _enum_reader(kind: type[Enum]) -> _Reader:
    def read(data: Any) -> Enum:
        try:
            return kind(data)
        except ValueError:
            known = ", ".join(str(member.value) for member in kind)
            raise ReportError(f": {data!r:.40} is not one of {known}") from None

    return read


def _tuple_reader(hints: tuple[Any, ...]) -> _Reader:
    endless = hints[-1] is ...
    many = "values" if hints[-1] is ... else len(hints)
    readers = [_reader(hint) for hint in hints if hint is not ...]
    plain = endless and _members(hints[0]) and not any(map(_members, _members(hints[0])))
    rows = _rows_reader(hints[0], readers[0]) if plain else partial(map, readers[0])

    def read(data: Any) -> tuple[Any, ...]:
        if not isinstance(data, list | tuple) or not (endless or len(data) == len(readers)):
            raise ReportError(f": {data!r:.40} is no list of {many}")
        done: list[Any] = []
        try:
            if endless:
                done.extend(rows(data))
            else:
                done.extend(reader(value) for reader, value in zip(readers, data, strict=True))
        except ReportError as error:
            raise ReportError(f"[{len(done)}]{error}") from None
        return tuple(done)

    return read


def _fields_reader(kind: type[Any]) -> _Reader:
    hints = get_type_hints(kind)
    readers = {field.name: _reader(hints[field.name]) for field in fields(kind)}
    needed = {field.name for field in fields(kind) if field.default is MISSING}

    def read(data: Any) -> Any:
        if not isinstance(data, dict):
            raise ReportError(f": {data!r:.40} is no object")
        if unknown := data.keys() - readers.keys():
            raise ReportError(f": unknown key {min(unknown)!r:.40}")
        if missing := needed - data.keys():
            raise ReportError(f": no {min(missing)}")
        values: dict[str, Any] = {}
        for name, value in data.items():
            try:
                values[name] = readers[name](value)
            except ReportError as error:
                raise ReportError(f".{name}{error}") from None
        return _made(kind, values)

    return read


def _made(kind: type[Any], values: Mapping[str, Any]) -> Any:
    try:
        return kind(**values)
    except ValueError as error:
        raise ReportError(f": {error}") from None


_PAGES: Final = (".html", ".htm", "")
_JSON: Final = ".json"
"""Suffix of the name of a report that is kept as JSON."""


def check_report(path: Path) -> None:
    """Check before a test run that its report can be written at the end.

    Args:
        path: path of the report.

    Raises:
        ValueError: the report cannot be written, because Jinja2 is not installed, the folder does
            not exist or is not writable, the path is a folder, or the suffix of the file is wrong.
    """
    if path.suffix.lower() not in (*_PAGES, _JSON) and not is_special(path):
        raise ValueError(f"report {path}: it is a page, as report.html, or JSON, as report.json")
    if path.suffix.lower() != _JSON and find_spec("jinja2") is None:
        raise ValueError("a report needs Jinja2: pip install 'tickrig[report]'")
    check_file(path, "report")


def write_report(report: BenchReport, path: Path) -> None:
    """Write a bench report as an HTML page, or as JSON if the name of the file ends in `.json`.

    An existing file is replaced only after the new file is complete.

    Raises:
        OSError: the file cannot be written. The `filename` of the exception is `path`.
        ImportError: Jinja2 is not installed (extra `report`).
    """
    if path.suffix.lower() == _JSON:
        write_run(report, path)
        return
    write_whole(path, page.html_page(report))


def write_run(report: BenchReport, path: Path) -> None:
    """Write a bench report as JSON.

    An existing file is replaced only after the new file is complete.

    Raises:
        OSError: the file cannot be written. The `filename` of the exception is `path`.
    """
    write_whole(path, to_json(report) + "\n")


def read_run(path: Path) -> BenchReport:
    """Read a bench report from a JSON file that `write_run` has written.

    Raises:
        OSError: the file cannot be read.
        ValueError: the file is not a report. The message has the place of the error.
    """
    try:
        with path.open(encoding="utf-8") as file:
            if not file.read(1):
                raise ReportError("not JSON: it is empty")
            file.seek(0)
            return _read(file)
    except UnicodeDecodeError as error:
        raise ValueError(f"not JSON: the byte at {error.start} is no UTF-8") from None
