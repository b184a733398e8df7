"""Notation of values: times (`1.5s`), sizes (`64k`), settings of inputs (`0x1F`)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from csv import reader
from math import inf, isfinite
from typing import Final

_TIME: Final = re.compile(r"([0-9]{1,9}(?:\.[0-9]{1,9})?)(s|ms|us)?")
_UNIT_US: Final = {"s": 1_000_000, "ms": 1_000, "us": 1}


def parse_time_us(text: str) -> int:
    """Read a time in microseconds.

    Raises:
        ValueError: the text is not a time.

    >>> parse_time_us("1.5s"), parse_time_us("200ms"), parse_time_us("3")
    (1500000, 200000, 3000000)
    """
    match = _TIME.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not a time: write 1.5s, 200ms or 250us")
    whole, _, fraction = match[1].partition(".")
    return int(f"{whole}{fraction:0<9}") * _UNIT_US[match[2] or "s"] // 1_000_000_000


def parse_time_with_unit_us(text: str) -> int:
    """Parse a time such as `1.5s` or `20ms`. Return it in microseconds. Only 0 needs no unit.

    Raises:
        ValueError: the text is not a time, or has no unit.

    >>> parse_time_with_unit_us("1.5s"), parse_time_with_unit_us("0")
    (1500000, 0)
    """
    us = parse_time_us(text)
    if us and not text.endswith("s"):
        raise ValueError(f"{text!r} has no unit: write {text}s, {text}ms or {text}us")
    return us


def us_of(duration: int | str) -> int:
    """Return a duration in microseconds, given as a whole number or as text such as `1.5s`.

    Raises:
        TypeError: the duration is neither a whole number nor a text.
        ValueError: the text is not a time or has no unit, or the duration is negative.

    >>> us_of("1.5s"), us_of(250)
    (1500000, 250)
    """
    if isinstance(duration, bool) or not isinstance(duration, int | str):
        raise TypeError(f'{duration!r} is not a time: write "1.5s", or whole microseconds')
    duration_us = parse_time_with_unit_us(duration) if isinstance(duration, str) else duration
    if duration_us < 0:
        raise ValueError(f"a duration is not negative, got {duration_us} us")
    return duration_us


def format_time(t_us: int) -> str:
    """Return a time in seconds as text, as in traces and transcripts.

    >>> format_time(310_000)
    '0.310000'
    """
    return f"{t_us // 1_000_000}.{t_us % 1_000_000:06d}"


_SIZE: Final = re.compile(r"([0-9]{1,12})([kKMG])?")
_SHIFT: Final = {"k": 10, "K": 10, "M": 20, "G": 30}


def parse_size(text: str) -> int:
    """Read a size in bytes.

    Raises:
        ValueError: the text is not a size.

    >>> parse_size("4096"), parse_size("64k"), parse_size("16M")
    (4096, 65536, 16777216)
    """
    match = _SIZE.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not a size: write 4096, 64k or 16M")
    return int(match[1]) << _SHIFT.get(match[2], 0)


MOST_PORT: Final = 0xFFFF


def parse_port(text: str) -> int | None:
    """Parse a TCP port, 0..65535, also with leading zeros. Return None for any other text.

    >>> parse_port("7000"), parse_port("007000"), parse_port("0100000"), parse_port("-1")
    (7000, 7000, None, None)
    """
    if not (text.isascii() and text.isdecimal()):
        return None
    number = int(text.lstrip("0")[:6] or "0")
    return number if number <= MOST_PORT else None


def counted(number: int, noun: str) -> str:
    """Return a number with its noun.

    >>> counted(1, "test"), counted(2, "test")
    ('1 test', '2 tests')
    """
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def aligned(rows: Iterable[Sequence[str]], left: float = inf) -> list[str]:
    """Return rows as lines whose columns are as wide as their content.

    Args:
        rows: cells of each row.
        left: number of columns that are aligned to the left. The others are aligned to the right.

    >>> aligned([("a", "bc"), ("def", "g")]), aligned([("a", "bc"), ("def", "g")], left=1)
    (['a    bc', 'def  g'], ['a    bc', 'def   g'])
    """
    rows = list(rows)
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    forms = [f"{'<' if place < left else '>'}{width}" for place, width in enumerate(widths)]
    return ["  ".join(map(format, row, forms)).rstrip() for row in rows]


Setting = int | float | str
"""Value of an input. Most inputs accept whole numbers only."""


def parse_setting(word: str) -> Setting:
    """Convert the text of an input's value to a number if possible. Otherwise return the text.

    >>> [parse_setting(word) for word in ("5", "-0x1F", "1e-3", "ready", "nan")]
    [5, -31, 0.001, 'ready', 'nan']
    """
    with suppress(ValueError):
        return int(word, 0)
    with suppress(ValueError):
        if isfinite(value := float(word)):
            return value
    return word


# Comma-separated lists of command lines.


def split_list(text: str) -> list[str]:
    """Split a list at its commas. An item with commas needs double quotes.

    >>> split_list('"sdo_slow=1s,count=2", drop')
    ['sdo_slow=1s,count=2', 'drop']
    """
    return [item.strip() for row in reader([text], skipinitialspace=True) for item in row]


def list_item(text: str) -> str:
    """Return an item of a list as text, in quotes if it has commas.

    >>> list_item("drop"), list_item("sdo_slow=1s,count=2")
    ('drop', '"sdo_slow=1s,count=2"')
    """
    return f'"{text}"' if "," in text else text
