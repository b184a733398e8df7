"""Nodes on their way back from bus-off."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.emulators.can.end import CanEnd

SEQUENCES: Final = 128
SEQUENCE_BITS: Final = 11
"""A node returns after 128 times 11 recessive bits in a row (ISO 11898-1, bus-off recovery)."""


class Recovery:
    """Counts, for each node that was asked to return, the sequences it has seen.

    Args:
        bit: length of a bit, in the units in which all times here are.

    Attributes:
        active: whether any node waits.
    """

    def __init__(self, bit: int) -> None:
        self._sequence = SEQUENCE_BITS * bit
        self._waiting: dict[int, tuple[CanEnd, int, int]] = {}  # end, sequences left, since
        self.active = False

    def begin(self, end: CanEnd, now: int) -> None:
        """Let a node wait; asking twice changes nothing."""
        self._waiting.setdefault(end.number, (end, SEQUENCES, now))
        self.active = True

    def leave(self, end: CanEnd) -> None:
        """Let a node wait no longer."""
        self._waiting.pop(end.number, None)
        self.active = bool(self._waiting)

    @property
    def due(self) -> int:
        """When the first node will be back if the bus stays recessive."""
        return min(
            (since + left * self._sequence for _, left, since in self._waiting.values()),
            default=NEVER,
        )

    def interrupt(self, at: int, until: int) -> None:
        """Count what was seen before a dominant bit `at`; the bus is recessive again at `until`."""
        for number, (end, left, since) in self._waiting.items():
            seen = max(0, at - since) // self._sequence
            self._waiting[number] = (end, left - seen, max(since, until))

    def take(self, now: int) -> list[CanEnd]:
        """Take the nodes that are back by `now`."""
        back = [
            end
            for end, left, since in self._waiting.values()
            if since + left * self._sequence <= now
        ]
        for end in back:
            self.leave(end)
        return back
