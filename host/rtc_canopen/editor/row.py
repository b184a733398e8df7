"""One line of a list that has a cursor."""

from __future__ import annotations

from typing import Generic, NamedTuple, TypeVar

from tickrig.host.tui.line_view import Line

T = TypeVar("T")


class Row(NamedTuple, Generic[T]):
    """A line, and what it stands for.

    Attributes:
        key: the same as long as it stands for the same, and that of no other row.
        line: the text.
        item: what it stands for.
    """

    key: str
    line: Line
    item: T
