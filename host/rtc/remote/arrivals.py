"""What peers brought, let in at each tick: nobody wakes the manager's thread for it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Final

from tickrig.wire.instant import NEVER


class Arrivals:
    """Calls that are made at the begin of the next tick; an item of a schedule.

    Nobody looks at a value before the next tick; to wake the thread of the manager for each would
    take three times the processor time.

    Attributes:
        due_us: it makes no tick come earlier.
    """

    due_us: Final = NEVER

    def __init__(self) -> None:
        self._calls: deque[Callable[[], object]] = deque()

    def post(self, call: Callable[[], object]) -> None:
        """Have a call made, in any thread."""
        self._calls.append(call)

    def tick(self, now_us: int, /) -> None:
        """Make the calls that wait; those that come meanwhile, too."""
        while self._calls:
            self._calls.popleft()()
