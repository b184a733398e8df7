"""The columns of the table of identifiers, and which of them a narrow screen leaves out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from tickrig.host.monitor.frames.ident import ident_text
from tickrig.host.monitor.frames.quantity import count_text, ms_text, rate_text, s_text
from tickrig.host.monitor.traffic.tally import IdRow


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
