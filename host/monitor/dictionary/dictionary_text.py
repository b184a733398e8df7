"""The objects of a node as lines of text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tickrig.host.monitor.decode.sdo.transfer import write_entry
from tickrig.host.monitor.dictionary.object_row import ObjectRow
from tickrig.host.monitor.frames.quantity import s_text

LEAST_NAME: Final = 12
MOST_NAME: Final = 36
VALUE: Final = 20


def render_dictionary(rows: Sequence[ObjectRow], now_us: int) -> list[str]:
    """Return a head, and a line for each object; what went wrong stands in the place of its type.

    Args:
        rows: the objects.
        now_us: the time for which ages are told.
    """
    longest = max((len(row.text.name) for row in rows), default=0)
    name = min(MOST_NAME, max(LEAST_NAME, longest))
    head = f"{'OBJECT':<9} {'NAME':<{name}} {'VALUE':<{VALUE}} {'FROM':<4} {'AGE':>7}  TYPE"
    return [head, *(_line(row, name, now_us) for row in rows)]


def _line(row: ObjectRow, name: int, now_us: int) -> str:
    age = "" if row.at_us is None else f"{s_text(now_us - row.at_us)} s"
    cells = [
        f"{write_entry(row.entry):<9}",
        f"{row.text.name[:name]:<{name}}",
        f"{row.value:<{VALUE}}",
        f"{row.origin:<4}",
        f"{age:>7}",
        f" {row.trouble or row.kind}",
    ]
    return " ".join(cells).rstrip()
