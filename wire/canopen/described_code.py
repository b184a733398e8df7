"""Codes of CANopen errors with their texts."""

from __future__ import annotations

from enum import IntEnum
from typing import Self


class DescribedCode(IntEnum):
    """Base class of enumerations of codes in which each member has a text.

    A member is written `NAME = code, text`.

    Attributes:
        text: meaning of the code.
    """

    text: str

    def __new__(cls, code: int, text: str) -> Self:
        """Make the member of a code."""
        self = int.__new__(cls, code)
        self._value_, self.text = code, text
        return self
