"""A line of text with styles, for whoever paints it.

>>> line_text((("185", "bold"), (" 37", "")))
'185 37'
"""

from __future__ import annotations

Line = tuple[tuple[str, str], ...]
"""Pieces of text, each with a style as `bold red`; empty for none."""


def plain(text: str, style: str = "") -> Line:
    """Return a line of one piece."""
    return ((text, style),)


def line_text(line: Line) -> str:
    """Return a line without its styles."""
    return "".join(text for text, _ in line)


def line_width(line: Line) -> int:
    """Return how many characters it has."""
    return sum(len(text) for text, _ in line)
