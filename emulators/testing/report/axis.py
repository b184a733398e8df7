"""The axis of time that faults, actions and values of a test share.

Positions are per cent of it, and so fit any width.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from tickrig.host.canmon.model.graph.chart import ticks

WIDE: Final = 25
"""Per cent of the axis on which a text has room, even on a phone."""


class Axis(NamedTuple):
    """The span of time that is shown.

    Attributes:
        from_us: its beginning,
        to_us: its end, later.
    """

    from_us: int
    to_us: int

    def part(self, at_us: int) -> float:
        """Return where a time is, in per cent from the left; what is outside is at the edge."""
        part = (at_us - self.from_us) * 100 / (self.to_us - self.from_us)
        return round(min(max(part, 0), 100), 2)

    @property
    def ticks(self) -> list[tuple[float, str]]:
        """Round times: where, and what is written there, in seconds."""
        marks = ticks(self.from_us / 1e6, self.to_us / 1e6, 5)
        return [(self.part(round(second * 1e6)), text) for second, text in marks]


class Span(NamedTuple):
    """Something that lasted.

    Attributes:
        left: where it begins, in per cent.
        width: in per cent.
        text: what it was.
    """

    left: float
    width: float
    text: str

    @property
    def place(self) -> str:
        """Where its text has room: `inside`, `behind` or `before`."""
        if self.width >= WIDE:
            return "inside"
        return "behind" if self.left + self.width <= 100 - WIDE else "before"
