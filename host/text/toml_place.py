r"""On which line of a TOML text a value stands; the parser of the standard library tells none.

>>> text = "a = 1\n[[step]]\nsend = [\n  {x = 1},\n  {y = 2},\n]\n"
>>> line_of(text, ("step", 0, "send", 1, "y")), line_of(text, ("step", 0))
(5, 2)
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from typing import Any, Final

CLOSING: Final = ("", "]", "]}", "]}]", "]}]}", "]}]}]")
"""What may be missing behind a line inside arrays and inline tables."""


def line_of(text: str, path: Sequence[str | int]) -> int:
    """Return the first line after which a value, or the beginning of it, is there.

    It reads the text once for each line: for error messages.

    Args:
        text: valid TOML.
        path: keys and indices from the top.

    Returns:
        The number of the line, from 1; 1 where nothing is there.
    """
    lines = text.splitlines()
    for number in range(1, len(lines) + 1):
        head = "\n".join(lines[:number])
        if any(_reaches(head + closing, path) for closing in CLOSING):
            return number
    return 1


def _reaches(text: str, path: Sequence[str | int]) -> bool:
    try:
        value: Any = tomllib.loads(text)
        for key in path:
            value = value[key]
    except (tomllib.TOMLDecodeError, LookupError, TypeError):
        return False
    return True
