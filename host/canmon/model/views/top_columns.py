"""The columns of the table of identifiers, and which of them a narrow screen leaves out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from tickrig.host.canmon.model.frames.ident import ident_text
from tickrig.host.canmon.model.frames.quantity import count_text, ms_text, rate_text, s_text
from tickrig.host.canmon.model.traffic.tally import BitRow, IdRow
from tickrig.host.text.page_text import in_cells

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
            _marked(
                heats[bit] if bit < len(heats) else UNCHANGED, styled and bool(latest >> bit & 1)
            )
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


class Column(NamedTuple):
    """A column of numbers.

    Attributes:
        title: its head.
        width: characters.
        rank: the highest goes first where there is no room.
        text: what it says of a row at a time.
    """

    title: str
    width: int
    rank: int
    text: Callable[[IdRow, int], str]


def _gap(name: str) -> Callable[[IdRow, int], str]:
    return lambda row, now_us: ms_text(getattr(row.gaps, name, None))


COLUMNS: Final = (
    Column("frames", 8, 1, lambda row, now_us: str(row.frames)),
    Column("1/s", 7, 0, lambda row, now_us: rate_text(row.rate_hz)),
    Column("gap ms", 8, 3, lambda row, now_us: ms_text(row.gap_us)),
    Column("min", 8, 6, _gap("min_us")),
    Column("avg", 8, 2, _gap("mean_us")),
    Column("p99", 8, 7, _gap("p99_us")),
    Column("max", 8, 4, _gap("max_us")),
    Column("jitter", 8, 8, _gap("jitter_us")),
    Column("missed", 6, 5, lambda row, now_us: count_text(getattr(row.gaps, "missed", None))),
    Column("age s", 7, 9, lambda row, now_us: s_text(now_us - row.last_us)),
)


class IdText(NamedTuple):
    """The leading column: bus, if there are several, and identifier.

    Attributes:
        channel_width: characters of the bus; 0 for none.
    """

    channel_width: int

    @property
    def width(self) -> int:
        """Characters in all."""
        return self.channel_width + (1 if self.channel_width else 0) + 9

    def of(self, row: IdRow) -> str:
        """Return what it says of a row."""
        return self._joined(row.channel, ident_text(row.ident))

    def title(self) -> str:
        """Return its head."""
        return self._joined("bus", "CAN-ID")

    def _joined(self, channel: str, ident: str) -> str:
        channel = in_cells(channel)
        return (
            f"{channel:<{self.channel_width}.{self.channel_width}} " * bool(self.channel_width)
            + f"{ident:<9}"
        )


def fitting(width: int) -> tuple[Column, ...]:
    """Return the columns that fit beside each other into so many characters."""
    kept = list(COLUMNS)
    while len(kept) > 1 and sum(column.width + 1 for column in kept) > width:
        kept.remove(max(kept, key=lambda column: column.rank))
    return tuple(kept)
