"""Tables of values at times, as a rig file has them.

>>> read_table(Path(), {"table": [[0, 12.0], ["4s", 10.0]]}).value(1_000_000)
11.5
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from tickrig.emulators.testing.signals.fields import number
from tickrig.emulators.testing.signals.sources import Table
from tickrig.emulators.testing.signals.table_file import (
    Points,
    read_points,
    seconds_us,
    usual_interpolation,
)
from tickrig.host.text.values import parse_time_us

INTERPOLATIONS: Final = ("linear", "hold")


def read_table(folder: Path, fields: Mapping[str, Any]) -> Table:
    """Return the table that fields of a signal describe.

    Args:
        folder: where files are looked for.
        fields: `table`, which is a list of points or the name of a file, and perhaps
            `column`, `interpolation`, `repeat`.

    Raises:
        ValueError: something in it is wrong; for a file with its name, and the line.
    """
    given, column = fields["table"], fields.get("column")
    way = fields.get("interpolation")
    if way is not None and way not in INTERPOLATIONS:
        raise ValueError(f"interpolation is {' or '.join(INTERPOLATIONS)}, not {way!r:.60}")
    if isinstance(given, str):
        path = folder / given
        points, usual = read_points(path, column), usual_interpolation(path)
    elif column is not None:
        raise ValueError("column belongs to a table in a file")
    else:
        points, usual = _inline(given), "linear"
    return _table(points, (way or usual) == "linear", fields.get("repeat", False))


def _table(points: Points, linear: bool, repeat: bool) -> Table:
    for (before_us, _), (at_us, _) in pairwise(points):
        if at_us < before_us:
            raise ValueError(f"{at_us / 1e6:g} s comes after {before_us / 1e6:g} s")
    times_us, values = zip(*points, strict=True)
    return Table(times_us, values, linear, repeat)


def _inline(given: object) -> Points:
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
    """Return the time of a point: text, or a number of seconds."""
    if isinstance(value, str):
        return parse_time_us(value)
    return seconds_us(number(value), 1_000_000)
