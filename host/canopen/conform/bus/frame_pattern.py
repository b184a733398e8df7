"""Frames in text, and patterns that they match."""

from __future__ import annotations

import re
from functools import cache


def can_id_of(pattern: str) -> str:
    """Return the CAN-ID of a frame or a pattern in text."""
    return pattern.partition("#")[0]


def matches(pattern: str, text: str) -> bool:
    """Compare frames; a dot stands for any digit, [..] for one of some, * for any rest.

    >>> matches("585#4F011000........", "585#4F01100003000000"), matches("185#*", "185#0100")
    (True, True)
    """
    return _compiled(pattern).fullmatch(text) is not None


@cache
def _compiled(pattern: str) -> re.Pattern[str]:
    return re.compile(pattern.replace("*", ".*"))
