"""A payload as text: its bytes, or how often each of its bits changes."""

from __future__ import annotations

from typing import Final

from tickrig.host.monitor.traffic.bits import BitRow
from tickrig.host.monitor.traffic.tally import IdRow

REVERSE: Final = "\x1b[7m"
PLAIN: Final = "\x1b[0m"

UNCHANGED: Final = "·"
NOTCHED: Final = " "
HEAT: Final = "▁▂▃▄▅▆▇█"
"""From a bit that changes seldom to one that changes with each frame."""


def data_text(row: IdRow, styled: bool) -> str:
    """Write the bytes of the latest frame; those that it changed are shown in reverse."""
    if row.frame.remote:
        return f"remote request for {row.frame.dlc}"
    latest = row.changed.latest & ~row.changed.notched
    cells = [
        _marked(f"{byte:02X}", styled and bool(latest >> 8 * place & 0xFF))
        for place, byte in enumerate(row.frame.data)
    ]
    return " ".join(cells)


def heat_text(row: IdRow, styled: bool) -> str:
    """Write a character for each bit, bit 7 of a byte first."""
    heats = _heats(row.changed, row.frames)
    latest = row.changed.latest & ~row.changed.notched
    cells = []
    for place in range(len(row.frame.data)):
        bits = [
            _marked(heats[bit], styled and bool(latest >> bit & 1))
            for bit in reversed(range(8 * place, 8 * place + 8))
        ]
        cells.append("".join(bits))
    return " ".join(cells)


def _heats(changed: BitRow, frames: int) -> list[str]:
    shown = changed.changed
    return [
        NOTCHED
        if changed.notched >> bit & 1
        else _heat(count, frames)
        if shown >> bit & 1
        else UNCHANGED
        for bit, count in enumerate(changed.counts())
    ]


def _heat(count: int, frames: int) -> str:
    """Return the character of a bit that changed so often in so many frames, 2 or more."""
    return HEAT[-(-count * len(HEAT) // (frames - 1)) - 1]


def _marked(text: str, marked: bool) -> str:
    return f"{REVERSE}{text}{PLAIN}" if marked else text
