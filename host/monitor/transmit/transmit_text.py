"""The transmit list as lines of text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tickrig.host.monitor.transmit.transmit_list import ONCE, TransmitRow

HEAD: Final = f"{'SENDS':<6} {'FRAME':<26} {'EVERY':>9} {'SENT':>8} {'MISSED':>7}  NAME"
ON, OFF, BY_HAND = "[x]", "[ ]", " - "


def render_transmit(rows: Sequence[TransmitRow]) -> list[str]:
    """Return a head, and a line for each row."""
    return [HEAD, *map(_line, rows)]


def _line(row: TransmitRow) -> str:
    mark = BY_HAND if row.period_us == ONCE else ON if row.enabled else OFF
    every = "" if row.period_us == ONCE else f"{row.period_us / 1_000:g} ms"
    frame = str(row.frame) + "*" * (row.fields.counters + row.fields.checksums != ())
    name = "" if row.name == str(row.frame) else row.name
    line = f"{mark:<6} {frame:<26} {every:>9} {row.sent:>8} {row.missed:>7}  {name}"
    return line.rstrip()
