"""Values of a rig file: each takes what TOML gives, or says what it takes instead.

>>> whole(1, 127)(5), framing("8N1")
(5, '8N1')
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from datetime import date, time
from math import isfinite
from typing import Any, Final

from tickrig.device.canopen.core.slave import UNCONFIGURED
from tickrig.emulators.canopen.node.node_spec import LSS
from tickrig.host.text.names import closest
from tickrig.host.text.values import parse_size, us_of

Field = Callable[[Any], Any]
"""Takes what TOML gives; ValueError with what was allowed."""

LONGEST: Final = 60
LONGEST_NAME: Final = 40
_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_FRAMING: Final = re.compile(r"[5-8][NEOMS](1|1\.5|2)")


def shown(value: object) -> str:
    """Write a value for people, in a line that is not too long.

    >>> shown(True), shown({"a": 1}), shown("x")
    ('true', 'a table', "'x'")
    """
    match value:
        case bool():
            return str(value).lower()
        case dict():
            return "a table"
        case list():
            return "a list"
        case date() | time():
            return value.isoformat()
    text = f"{value!r:.{LONGEST + 1}}" if isinstance(value, str) else str(value)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."


def text(value: object) -> str:
    """Take a text that is not empty."""
    if isinstance(value, str) and value:
        return value
    raise ValueError(f"it takes a text, not {shown(value)}")


def texts(value: object) -> tuple[str, ...]:
    """Take a text or a list of them."""
    values = value if isinstance(value, list) else [value]
    if values and all(isinstance(each, str) and each for each in values):
        return tuple(values)
    raise ValueError(f"it takes a text or a list of texts, not {shown(value)}")


def command(value: object) -> tuple[str, ...]:
    """Take a command line, as words or as one text that is split like a shell does."""
    if isinstance(value, list):
        return texts(value)
    try:
        if words := shlex.split(text(value)):
            return tuple(words)
    except ValueError as error:
        if isinstance(value, str) and value:
            raise ValueError(f"{shown(value)}: {str(error).lower()}") from None
    raise ValueError(f"it takes a command line, not {shown(value)}")


def path(value: object) -> str:
    """Take the name of a file."""
    if isinstance(value, str) and value and "\0" not in value:
        return value
    raise ValueError(f"it takes the name of a file, not {shown(value)}")


def flag(value: object) -> bool:
    """Take true or false."""
    if isinstance(value, bool):
        return value
    raise ValueError(f"it takes true or false, not {shown(value)}")


def table(value: object) -> dict[str, Any]:
    """Take a table."""
    if isinstance(value, dict):
        return value
    raise ValueError(f"it takes a table, not {shown(value)}")


def whole(low: int, high: int) -> Field:
    """Return what takes a whole number of a range."""

    def take(value: object) -> int:
        if isinstance(value, int) and not isinstance(value, bool) and low <= value <= high:
            return value
        raise ValueError(f"it takes a whole number {low}..{high}, not {shown(value)}")

    return take


def number(low: float, high: float) -> Field:
    """Return what takes a number of a range."""

    def take(value: object) -> float:
        fits = isinstance(value, int | float) and not isinstance(value, bool)
        if fits and low <= value <= high and isfinite(value):  # type: ignore[operator,arg-type]
            return value  # type: ignore[return-value]
        raise ValueError(f"it takes a number {low:g}..{high:g}, not {shown(value)}")

    return take


def one_of(*names: str) -> Field:
    """Return what takes one of some words."""

    def take(value: object) -> str:
        if isinstance(value, str) and value in names:
            return value
        close = isinstance(value, str) and closest(value, names)
        hint = f"; did you mean {close[0]!r}?" if close else ""
        raise ValueError(f"it takes {', '.join(names)}, not {shown(value)}{hint}")

    return take


def framing(value: object) -> str:
    """Take data bits, parity and stop bits."""
    if isinstance(value, str) and _FRAMING.fullmatch(value):
        return value
    raise ValueError(f"it takes data bits, parity and stop bits as 8N1, not {shown(value)}")


def node_id(value: object) -> int:
    """Take a node-ID, or the word of a node that waits for one."""
    if value == LSS:
        return UNCONFIGURED
    if isinstance(value, int) and not isinstance(value, bool) and 1 <= value <= 127:
        return value
    raise ValueError(f"it takes 1..127, or {LSS} for a node that waits for LSS, not {shown(value)}")


def duration(value: object) -> int:
    """Take a time as a text, of 1 us at least; in microseconds."""
    if isinstance(value, str) and (duration_us := us_of(value)):
        return duration_us
    raise ValueError(f'it takes a time as "500ms", above 0, not {shown(value)}')


def size(value: object) -> int:
    """Take a number of bytes, or a text as `64k`."""
    if isinstance(value, int) and not isinstance(value, bool) and value >= 0:
        return value
    if isinstance(value, str):
        return parse_size(value)
    raise ValueError(f'it takes bytes as 4096 or "64k", not {shown(value)}')


def check_name(name: str) -> None:
    """Raise ValueError unless a device, wire or signal can be called so."""
    if len(name) > LONGEST_NAME:
        raise ValueError(f"a name of {len(name)} letters; {LONGEST_NAME} are enough")
    if not _NAME.fullmatch(name):
        fitting = re.sub(r"\W", "_", name, flags=re.ASCII)
        hint = f", as {fitting}" if _NAME.fullmatch(fitting) else ""
        raise ValueError(f"a name is letters, digits and _, a letter first{hint}")
