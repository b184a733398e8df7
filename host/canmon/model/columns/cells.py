"""Columns of numbers as text, each number as `str` writes it.

The module needs numpy.

>>> parts, right = scaled(np.array([1, 3, -25]), Scale.of(0.1, 0))
>>> joined(3, [*parts, b" "]), right.tolist()
('0.1 0.3 -2.5 ', [True, False, True])
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from decimal import Decimal
from functools import cached_property, lru_cache
from math import isfinite
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

# A text is a row of bytes, zeros where it has fewer characters than others of its column: one call
# takes all zeros out, once lines are put together. A number of few bits has its text in a table
# that grows with the numbers that come. Others are written four digits at a time, by a table.
#
# A number with decimals is the float nearest to raw * factor + offset, and its text the shortest
# that gives this float back. Where that float is also the one nearest to the exact decimal number,
# and this has at most 15 digits, the two texts are the same: no other decimal number of 15 digits
# has this float. So the exact number is written, in integers, and all others (0.1 * 3 is
# 0.30000000000000004) are left to `str`. A number takes some 0.05 us, where `str` takes 0.5 us.

Cells = npt.NDArray[np.uint8]
"""A part of each line, as a row of characters with zeros after a short text."""

Part = bytes | Cells
"""A part of lines: one text for all lines, or one text for each line."""

Mask = npt.NDArray[np.bool_]

_RADIX: Final = 10_000
_EXACT: Final = 10**15
"""Amount below which two different decimal numbers are different floats."""
_PLACES: Final = 8
"""Number of decimals up to which exact numbers are written."""
_SMALLEST: Final = 1e-4
"""Amount below which `str` writes an exponent."""
WHOLE: Final = 1 << 62
"""Amount below which whole numbers are written at once."""
_WIDEST: Final = 256
"""Length of a text above which the text is kept apart, because all rows would become long."""
_MARK: Final = "\x01"
"""Mark for the place of a wide text. No text of a line contains this character."""


def table(texts: Sequence[str], dtype: str) -> npt.NDArray[Any]:
    """Pack each text into the bytes of one integer, and return the array of integers.

    The array is a lookup table: numpy can take the texts of many rows from it at once by index.

    Args:
        texts: ASCII texts. A text may have at most as many characters as an integer of the array
            has bytes.
        dtype: numpy data type of the integers, such as `<u4` for texts of up to four characters.
    """
    size = np.dtype(dtype).itemsize
    return np.array([text.encode() for text in texts], f"S{size}").view(dtype)


def of(numbers: npt.NDArray[Any]) -> Cells:
    """Return the characters of numbers that `table` made, with a row for each number."""
    return np.ascontiguousarray(numbers).view(np.uint8).reshape(len(numbers), -1)


def encoded(text: str) -> bytes:
    """Return a text as the bytes of a row."""
    return text.encode("utf-8", "surrogatepass")


def of_texts(texts: Iterable[str]) -> Cells:
    """Return texts as rows."""
    return of(np.array([*map(encoded, texts)], "S")[:, np.newaxis])


def together(count: int, parts: Sequence[Part]) -> Cells:
    """Combine the parts of all lines."""
    widths = [len(part) if isinstance(part, bytes) else part.shape[1] for part in parts]
    rows, begin = np.empty((count, sum(widths)), np.uint8), 0
    for part, width in zip(parts, widths, strict=True):
        row = np.frombuffer(part, np.uint8) if isinstance(part, bytes) else part
        rows[:, begin : begin + width] = row
        begin += width
    return rows


def joined(count: int, parts: Sequence[Part]) -> str:
    """Return all lines as one text."""
    rows = together(count, parts)
    found: bytes = rows[rows != 0].tobytes()
    return found.decode("utf-8", "surrogatepass")


def where(rows: Mask, text: bytes, other: bytes = b"") -> Cells:
    """Return an array of characters in which each row has one of two texts.

    Args:
        rows: mask that selects the text of each row.
        text: text of the rows for which the mask is True.
        other: text of all other rows.
    """
    width = max(len(text), len(other))
    both = np.array([other, text], f"S{width}")
    return of(both[:, np.newaxis])[rows.astype(np.int8)]


def of_few(values: npt.NDArray[Any], write: Callable[[int], str]) -> Cells:
    """Write numbers that have few different values."""
    found, places = np.unique(values, return_inverse=True)
    return of_texts(map(write, found.tolist()))[places]


class Texts:
    """Texts of the frames in a block, such as their meanings. At first, all texts are empty.

    Args:
        count: number of frames in the block.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._pieces: list[tuple[npt.NDArray[np.int64], Cells]] = []
        self._single: dict[int, str] = {}
        self._wide: dict[int, str] = {}

    def put(self, rows: npt.NDArray[np.int64], texts: Cells) -> None:
        """Set the texts of some rows.

        Args:
            rows: indices of the rows.
            texts: one text for each of these rows, or a single text for all of them. No text may be
                empty.
        """
        if texts.shape[1] <= _WIDEST:
            self._pieces.append((rows, texts))
            return
        found = joined(len(texts), [texts, b"\n"]).split("\n")[:-1]
        self._wide |= zip(rows.tolist(), found * (len(rows) // len(found)), strict=True)

    def put_one(self, row: int, text: str) -> None:
        """Set the text of a row."""
        (self._single if len(text) <= _WIDEST else self._wide)[row] = text

    @cached_property
    def cells(self) -> Cells:
        """The texts as an array of characters, with one row for each text.

        Empty texts and the ends of short texts are filled with zeros. In place of a text that is
        too wide for the array, the row has the character `_MARK`.
        """
        pieces = list(self._pieces)
        for found in (self._single, dict.fromkeys(self._wide, _MARK)):
            if found:
                pieces.append((np.array(list(found)), of_texts(found.values())))
        width = max((piece.shape[1] for _, piece in pieces), default=1)
        rows = np.zeros((self._count, width), np.uint8)
        for places, piece in pieces:
            rows[places, : piece.shape[1]] = piece
        return rows

    def lines(self, rows: slice, parts: Sequence[Part] = ()) -> str:
        """Return some rows as lines, each with the given parts before its text."""
        texts = self.cells[rows]
        found = joined(len(texts), [*parts, texts, b"\n"])
        if not self._wide or _MARK not in found:
            return found
        here = range(*rows.indices(self._count))
        wide = [self._wide[row] for row in sorted(row for row in self._wide if row in here)]
        between = found.split(_MARK)
        return "".join([part for pair in zip(between, [*wide, ""], strict=True) for part in pair])


class TextTable:
    """Cache of the texts for small numbers, such as node-IDs.

    Each text is made when its number first occurs.

    Args:
        bits: number of bits of the largest possible number.
        write: function that returns the text of a number.
    """

    def __init__(self, bits: int, write: Callable[[int], str]) -> None:
        self._write, self._rows = write, np.zeros((1, 1), np.uint8)
        self._places = np.zeros(1 << bits, np.int32)

    def cells(self, numbers: npt.NDArray[np.int64]) -> Cells:
        """Return the texts of these numbers."""
        places = self._places[numbers]
        if not places.all():
            new = np.unique(numbers[places == 0])
            rows = of_texts(map(self._write, new.tolist()))
            width = max(rows.shape[1], self._rows.shape[1])
            self._places[new] = np.arange(len(self._rows), len(self._rows) + len(new))
            self._rows = np.concatenate((widened(self._rows, width), widened(rows, width)))
            places = self._places[numbers]
        return self._rows.take(places, 0)


def widened(rows: Cells, width: int) -> Cells:
    """Return the rows, padded with zeros to at least this many characters."""
    if rows.shape[1] >= width:
        return rows
    wide = np.zeros((len(rows), width), np.uint8)
    wide[:, : rows.shape[1]] = rows
    return wide


@lru_cache(1)
def _begins() -> npt.NDArray[np.uint32]:
    """Return texts of four digits at the start of a number, and from 10,000 on, as later digits."""
    numbers, tens = np.arange(_RADIX)[:, np.newaxis], np.array([1_000, 100, 10, 1])
    digits = (numbers // tens % 10 + ord("0")).astype(np.uint8)
    rows = np.concatenate((np.where(numbers >= tens, digits, np.uint8(0)), digits))
    return rows.view("<u4")[:, 0]


@lru_cache(1)
def _ends() -> npt.NDArray[np.uint32]:
    """Return texts of four digits without zeros at the end. For 0000, one zero remains."""
    numbers, tens = np.arange(_RADIX)[:, np.newaxis], np.array([1_000, 100, 10, 1])
    digits = (numbers // tens % 10 + ord("0")).astype(np.uint8)
    rows = np.where((numbers % (10 * tens) != 0) | (tens == 1_000), digits, np.uint8(0))
    return rows.astype(np.uint8).view("<u4")[:, 0]


def whole(numbers: npt.NDArray[np.int64]) -> list[Part]:
    """Write whole numbers whose amount is below `WHOLE`."""
    if not len(numbers) or numbers.min() >= 0:
        return [_digits(numbers)]
    return [where(numbers < 0, b"-"), _digits(np.abs(numbers))]


def hexadecimal(numbers: npt.NDArray[np.int64], count: int) -> Cells:
    """Write the lowest `count` bytes of numbers, with two hex digits for each byte."""
    octets = numbers.astype(">u8").view(np.uint8).reshape(-1, 8)[:, 8 - count :]
    return of(_pairs()[octets])


@lru_cache(1)
def _pairs() -> npt.NDArray[np.uint16]:
    return table([f"{octet:02X}" for octet in range(256)], "<u2")


def _digits(numbers: npt.NDArray[np.int64]) -> Cells:
    most, rest, begins = int(numbers.max(initial=0)), numbers, _begins()
    if most >> 32 == 0:
        rest = numbers.astype(np.uint32)  # divided in half the time
    groups = np.empty((len(numbers), max(1, -(-len(str(most)) // 4))), np.uint32)
    for place in range(groups.shape[1] - 1, 0, -1):
        high = rest // _RADIX
        groups[:, place] = begins[rest - high * _RADIX + (high > 0) * np.uint16(_RADIX)]
        rest = high
    groups[:, 0] = begins[rest]
    rows = of(groups)
    rows[numbers == 0, -1] = ord("0")
    return rows


class Scale(NamedTuple):
    """Conversion of an integer in a frame to a physical value: raw * factor + offset.

    The conversion is also stored with integers only, so that the decimal digits of a value can be
    calculated exactly.

    Attributes:
        factor: factor of the conversion.
        offset: offset of the conversion.
        tens: power of ten by which factor and offset are multiplied to become integers.
        times: factor multiplied by `tens`, an integer.
        more: offset multiplied by `tens`, an integer.
    """

    factor: float
    offset: float
    tens: int
    times: int
    more: int

    @classmethod
    def of(cls, factor: float, offset: float) -> Scale | None:
        """Return the scale, or None if the exact numbers have too many digits."""
        if not (isfinite(factor) and isfinite(offset) and factor):
            return None
        both = Decimal(repr(factor)), Decimal(repr(offset))
        places = max(-int(one.normalize().as_tuple().exponent) for one in both)
        if places > _PLACES:
            return None
        tens = 10 ** (4 if places <= 4 else _PLACES)
        times, more = (int(one * tens) for one in both)
        most = _EXACT - abs(more) - abs(times)
        return cls(factor, offset, tens, times, more) if most > 0 else None


def scaled(numbers: npt.NDArray[np.int64], scale: Scale) -> tuple[list[Part], Mask]:
    """Return the physical values of many integers as texts.

    A correct text is the text that `str` returns for the value as a float. For some values, such as
    very large and very small ones, the text of this function may differ from it. The returned mask
    has an element for each integer. It is True if the text is certainly correct. If it is False,
    the caller must use the text of `str` instead.

    Args:
        numbers: integers from the frames.
        scale: conversion of the integers to physical values.

    Returns:
        The parts of the texts, and the mask. The parts are sign, digits before the decimal point,
        point, and decimals. For each integer, the caller joins its parts.
    """
    factor, offset, tens, times, more = scale
    limit = (_EXACT - abs(more)) // abs(times)
    right = (numbers <= limit) & (numbers >= -limit)
    exact = np.where(right, numbers, 0) * times + more
    floats = numbers.astype(np.float64) * factor + offset
    amounts = np.abs(exact)
    right &= (floats == exact / tens) & ((amounts >= tens * _SMALLEST) | (exact == 0))
    right &= (exact != 0) | ~np.signbit(floats)
    before = amounts // tens
    decimals = amounts - before * tens
    parts: list[Part] = [where(exact < 0, b"-")] if (exact < 0).any() else []
    return [*parts, _digits(before), b".", _decimals(decimals, tens)], right


def _decimals(numbers: npt.NDArray[np.int64], tens: int) -> Cells:
    """Write four or eight digits after the point, without zeros at the end."""
    if tens == _RADIX:
        return of(_ends()[numbers])
    high = numbers // _RADIX
    low = numbers - high * _RADIX
    groups = np.empty((len(numbers), 2), np.uint32)
    groups[:, 0] = np.where(low == 0, _ends()[high], _begins()[high + _RADIX])
    groups[:, 1] = np.where(low == 0, np.uint32(0), _ends()[low])
    return of(groups)
