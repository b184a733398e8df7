"""Tables of values at times, as in a rig file.

>>> read_table(Path(), {"table": [[0, 12.0], ["4s", 10.0]]}).value(1_000_000)
11.5

Files with values at times: CSV, CAN logs, traces.

>>> [point for _, point in _csv_points(["t_ms,v", "0,12.5", "20,12.25"], None)]
[(0, 12.5), (20000, 12.25)]
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tickrig._lazy import LazyModule
from tickrig.emulators.record.replay import read_bench_recording
from tickrig.emulators.testing.signals.sources import ValueTable, number
from tickrig.host.text.names import near
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import parse_time_us

if TYPE_CHECKING:
    from tickrig.host.canmon.model.graph import series
    from tickrig.host.canmon.model.logs import log_reader
else:  # columns of CAN logs alone need them
    series = LazyModule("tickrig.host.canmon.model.graph.series")
    series = LazyModule("tickrig.host.canmon.model.graph.series")
    log_reader = LazyModule("tickrig.host.canmon.model.logs.log_reader")

_Points = Sequence[tuple[int, float]]
"""Times in microseconds, and values."""

_MOST: Final = 1_000_000
"""Largest number of values in a file."""

_UNITS: Final = {"_us": 1, "_ms": 1_000, "_s": 1_000_000}
"""Endings of the name of a column with times, and the unit in microseconds. Other columns are in
seconds."""

_TRACE: Final = ".trace"


def _seconds_us(value: float, unit_us: int) -> int:
    """Convert a time of at least 0 to microseconds; raise ValueError for other values."""
    if not 0 <= value * unit_us < 1e18:
        raise ValueError(f"{value:g} is no time from 0 on")
    return round(value * unit_us)


def _usual_interpolation(path: Path) -> str:
    """Return the default interpolation of a file; values of a trace hold until the next change."""
    return "hold" if path.suffix == _TRACE else "linear"


def read_points(path: Path, column: str | None) -> _Points:
    """Read the times and values of a signal from one column of a file.

    Args:
        path: path of a CSV file, a trace, or a CAN log. The suffix selects the format.
        column: name of a column of a CSV file, name of an input of a trace, or bits of a frame in a
            CAN log. For example, `181[2:6]s*0.001` means bytes 2 to 5 of frame 181h, signed, times
            0.001. None is possible only for a CSV file with two columns: the first column has the
            times, and None selects the second one.

    Raises:
        ValueError: the file cannot be read, has no such column, or has no value in this column.
    """
    try:
        points = _READERS.get(path.suffix.lower(), _read_log)(path, column)
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror or error}") from None
    except ValueError as error:
        raise ValueError(str(error) if str(path) in str(error) else f"{path}: {error}") from None
    if not points:
        raise ValueError(f"{path} has no value{f' of {column}' if column else ''}")
    if len(points) > _MOST:
        raise ValueError(f"{path} has {len(points)} values; at most {_MOST} are taken")
    return points


def _read_trace(path: Path, column: str | None) -> _Points:
    """Return the changes of an input in a trace; the input has no value before the first change."""
    if column is None:
        raise ValueError("column is missing: the name of an input")
    records = read_bench_recording(path.read_bytes()).records
    changes = [
        (record, *record.change)
        for record in records
        if record.mark is Mark.PHYSICAL and record.change
    ]
    found = [
        (record.at_us, record.name, value)
        for record, name, value in changes
        if column in (name, f"{record.name}/{name}")
    ]
    if len(devices := {device for _, device, _ in found}) > 1:
        names = ", ".join(f"{device}/{column}" for device in sorted(devices))
        raise ValueError(f"column {column!r} is not of one device: name one of {names}")
    return [(at_us, float(value)) for at_us, _, value in found if not isinstance(value, str)]


def _read_log(path: Path, column: str | None) -> _Points:
    """Return the values in frames of a CAN log, from its first frame on."""
    if column is None:
        raise ValueError("column is missing: bits of a frame, as 181[2:6]s*0.001")
    bits = series.parse_slice(column)
    collector = series.Collector([series.CurveSpec("", bits, 1, column)])
    begin_us = None
    for record in log_reader.read_log(path):
        begin_us = record.at_us if begin_us is None else begin_us
        collector.take(record)
    curve = collector.series[0]
    return [
        (max(0, at_us - (begin_us or 0)), value)
        for at_us, value in zip(curve.at_us, curve.values, strict=True)
    ]


def _read_csv(path: Path, column: str | None) -> _Points:
    """Return a column of a CSV file whose first column is the time."""
    points: list[tuple[int, float]] = []
    for line, point in _csv_points(path.read_text("utf-8-sig").splitlines(), column):
        if points and point[0] < points[-1][0]:
            raise ValueError(f"line {line}: its time is before that of the line above it")
        points.append(point)
    return points


def _csv_points(
    lines: Sequence[str], column: str | None
) -> Iterator[tuple[int, tuple[int, float]]]:
    """Yield the points with the numbers of their lines."""
    rows = _rows(lines)
    line, head = next(rows, (0, []))
    named = bool(head) and not _is_number(head[0])
    place = _place(head, column) if head else 0
    unit_us = next((_UNITS[end] for end in _UNITS if named and head[0].endswith(end)), 1_000_000)
    if head and not named:
        yield line, _point(line, head, place, unit_us)
    for line, row in rows:
        yield line, _point(line, row, place, unit_us)


def _rows(lines: Sequence[str]) -> Iterator[tuple[int, list[str]]]:
    """Yield the cells of each line, with its number; the first line determines the separator."""
    comma = ""
    for line, text in enumerate(lines, 1):
        if not text.strip() or text.startswith("#"):
            continue
        comma = comma or next((mark for mark in ";\t" if mark in text), ",")
        try:
            row = next(csv.reader([text], delimiter=comma))
        except csv.Error as error:
            raise ValueError(f"line {line}: {error}") from None
        yield line, [cell.strip() for cell in row]


def _point(line: int, row: list[str], place: int, unit_us: int) -> tuple[int, float]:
    try:
        return _seconds_us(float(row[0]), unit_us), float(number(float(row[place])))
    except IndexError:
        raise ValueError(f"line {line} has {len(row)} columns") from None
    except ValueError as error:
        raise ValueError(f"line {line}: {error}") from None


def _place(head: list[str], column: str | None) -> int:
    """Return the index of the column; `column` may be None if there is only one."""
    if column is None and len(head) == 2:
        return 1
    if column in head[1:]:
        return head.index(column, 1)
    known = ", ".join(head[1:]) or "none"
    if column is None:
        raise ValueError(f"column is missing: one of {known}")
    raise ValueError(f"no column {column!r}; {near(column, head[1:])}")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


_READERS: Final[Mapping[str, Callable[[Path, str | None], _Points]]] = {
    ".csv": _read_csv,
    _TRACE: _read_trace,
}
"""Readers of files by suffix; CAN logs have several suffixes."""


_INTERPOLATIONS: Final = ("linear", "hold")


def read_table(folder: Path, fields: Mapping[str, Any]) -> ValueTable:
    """Make a signal that follows a table of times and values, as a rig file describes it.

    Args:
        folder: folder of the files.
        fields: fields `table` and optionally `column`, `interpolation` and `repeat`. The `table` is
            a list of points or the name of a file.

    Raises:
        ValueError: a field is invalid. For a file, the message has the name and the line.
    """
    given, column = fields["table"], fields.get("column")
    way = fields.get("interpolation")
    if way is not None and way not in _INTERPOLATIONS:
        raise ValueError(f"interpolation is {' or '.join(_INTERPOLATIONS)}, not {way!r:.60}")
    if isinstance(given, str):
        path = folder / given
        points, usual = read_points(path, column), _usual_interpolation(path)
    elif column is not None:
        raise ValueError("column belongs to a table in a file")
    else:
        points, usual = _inline(given), "linear"
    return _table(points, (way or usual) == "linear", fields.get("repeat", False))


def _table(points: _Points, linear: bool, repeat: bool) -> ValueTable:
    for (before_us, _), (at_us, _) in pairwise(points):
        if at_us < before_us:
            raise ValueError(f"{at_us / 1e6:g} s comes after {before_us / 1e6:g} s")
    times_us, values = zip(*points, strict=True)
    return ValueTable(times_us, values, linear, repeat)


def _inline(given: object) -> _Points:
    form = 'a list of times and values, as [[0, 12.0], ["5s", 9.5]], or the name of a file'
    if not isinstance(given, list) or not given:
        raise ValueError(f"it is {form}; not {given!r:.60}")
    points = []
    for item in given:
        if not isinstance(item, list) or len(item) != 2:
            raise ValueError(f"it is {form}; {item!r:.60} is no time and value")
        points.append((_point_us(item[0]), float(number(item[1]))))
    return points


def _point_us(value: object) -> int:
    """Return the time of a point, which is a text or a number of seconds."""
    if isinstance(value, str):
        return parse_time_us(value)
    return _seconds_us(number(value), 1_000_000)
