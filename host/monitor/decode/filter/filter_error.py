"""A filter that cannot be read."""

from __future__ import annotations


class FilterError(ValueError):
    """Text that is no filter.

    Attributes:
        column: where, from 1.
    """

    def __init__(self, text: str, column: int, reason: str) -> None:
        super().__init__(f"filter {text!r}, column {column}: {reason}")
        self.column = column
