"""What a slave of a user has raised, in a line, and where."""

from __future__ import annotations

import linecache
from collections.abc import Iterator
from pathlib import Path
from traceback import walk_tb
from typing import Final

OURS: Final = "tickrig."


def crash_text(error: Exception) -> str:
    """Return what was raised, in a line.

    >>> crash_text(KeyError("x"))
    "your slave raised KeyError: 'x'"
    """
    kind = type(error)
    name = kind.__name__ if kind.__module__ == "builtins" else f"{kind.__module__}.{kind.__name__}"
    text = " ".join(str(error).split())
    return f"your slave raised {name}: {text}" if text else f"your slave raised {name}"


def crash_lines(error: Exception) -> list[str]:
    """Return the lines at which it was raised, outermost first, but for those of the bench."""
    return list(_lines(error))


def _lines(error: Exception) -> Iterator[str]:
    for frame, line in walk_tb(error.__traceback__):
        if not str(frame.f_globals.get("__name__", "")).startswith(OURS):
            code = frame.f_code
            text = linecache.getline(code.co_filename, line, frame.f_globals).strip()
            yield f"{Path(code.co_filename).name}:{line} in {code.co_name}: {text}"
