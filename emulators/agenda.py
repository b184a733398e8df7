"""What is to be done between the ticks of a rig, and when."""

from __future__ import annotations

from collections.abc import Callable, Hashable

from tickrig.device.core import NEVER

Action = Callable[[int], None]
"""Something to do; it is told the time in microseconds."""


class Agenda:
    """Actions by time; those of the same time in the order they were entered."""

    def __init__(self) -> None:
        self._entries: dict[Hashable, tuple[int, Action]] = {}
        self.due_us = NEVER

    def put(self, key: Hashable, t_us: int, action: Action) -> None:
        """Enter an action; one entered before under the same key is forgotten."""
        self._entries.pop(key, None)
        self._entries[key] = (t_us, action)
        self._note_due()

    def drop(self, key: Hashable) -> None:
        """Forget an action; one that is not there is no error."""
        self._entries.pop(key, None)
        self._note_due()

    def run(self, now_us: int) -> None:
        """Do what is due at `now_us`."""
        while self.due_us <= now_us:
            key, (_, action) = min(self._entries.items(), key=lambda item: item[1][0])
            self.drop(key)
            action(now_us)

    def _note_due(self) -> None:
        self.due_us = min((t_us for t_us, _ in self._entries.values()), default=NEVER)
