"""A queue of actions between ticks, sorted by time and order of entry."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from heapq import heappop, heappush
from typing import Final

from tickrig.device.twin import Part, restore, state_of
from tickrig.wire.instant import NEVER

_Action = Callable[[int], None]
"""An action, called with the time in microseconds."""

_SPARE: Final = 64
"""Number of cancelled actions that may stay in the heap, in addition to one for each valid
action."""

_Entry = tuple[int, int, Hashable, _Action]
"""Time, entry number, key and action."""


class EventQueue(Part):
    """Queue of the actions that a rig executes at given times.

    Actions with the same time are executed in the order in which they were added.
    """

    def __init__(self) -> None:
        self._number = 0
        self._heap: list[_Entry] = []
        self._entered: dict[Hashable, int] = {}
        """Number of the valid entry by key; other entries in the heap are cancelled."""
        self.due_us = NEVER

    def put(self, key: Hashable, t_us: int, action: _Action) -> None:
        """Add an action; it replaces an earlier action with the same key."""
        self._number += 1
        self._entered[key] = self._number
        heappush(self._heap, (t_us, self._number, key, action))
        self._note_due()

    def wake(self, key: Hashable, t_us: int) -> None:
        """Make the rig stop at a time, so that its watchers are called then.

        This is `put` with an action that does nothing.
        """
        self.put(key, t_us, _nothing)

    def __getstate__(self) -> object:
        """Return the state without cancelled actions."""
        return state_of(self, {"_heap": sorted(filter(self._holds, self._heap))})

    def __setstate__(self, state: object) -> None:
        """Restore the copied state."""
        restore(self, state)

    def drop(self, key: Hashable) -> None:
        """Cancel an action; do nothing if there is no action with the key."""
        if self._entered.pop(key, None) is not None:
            self._note_due()

    def run(self, now_us: int) -> None:
        """Run the actions due at `now_us`."""
        while self.due_us <= now_us:
            _, _, key, action = self._heap[0]
            self.drop(key)
            action(now_us)

    def _note_due(self) -> None:
        if len(self._heap) > 2 * len(self._entered) + _SPARE:
            self._heap = sorted(entry for entry in self._heap if self._holds(entry))
        while self._heap and not self._holds(self._heap[0]):
            heappop(self._heap)
        self.due_us = self._heap[0][0] if self._heap else NEVER

    def _holds(self, entry: _Entry) -> bool:
        return self._entered.get(entry[2]) == entry[1]


def _nothing(now_us: int) -> None:
    """Do nothing."""
