"""What a replay is made of: a port that plays, and the comparison of what was said."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Generic

from tickrig.device.core import W
from tickrig.wire.instant import NEVER


@dataclass(frozen=True, slots=True)
class Difference(Generic[W]):
    """The first tick at which a replay did not say what was recorded.

    Attributes:
        at_us: the tick.
        recorded: what the device said then.
        replayed: what it says now.
        line: the line of the trace, 0 if it said nothing then.
    """

    at_us: int
    recorded: W
    replayed: W
    line: int


class ReplayPort(Generic[W]):
    """Gives a device what it received at the ticks it received it.

    Args:
        received: the traffic with its times.
        nothing: empty traffic.

    Attributes:
        sent: what the device says, with its times.
    """

    def __init__(self, received: Iterable[tuple[int, W]], nothing: W) -> None:
        self._received, self._nothing = deque(received), nothing
        self.sent: list[tuple[int, W]] = []

    @property
    def due_us(self) -> int:
        """When there is something next."""
        return self._received[0][0] if self._received else NEVER

    def poll(self, now_us: int, /) -> W:
        """Take what was received by now."""
        out = self._nothing
        while self._received and self._received[0][0] <= now_us:
            out += self._received.popleft()[1]  # type: ignore[operator]  # bytes or a tuple
        return out

    def send(self, now_us: int, traffic: W, /) -> None:
        """Take what the device says."""
        if traffic:
            self.sent.append((now_us, traffic))


def first_difference(
    recorded: Sequence[tuple[int, W, int]], replayed: Sequence[tuple[int, W]], nothing: W
) -> Difference[W] | None:
    """Return the first tick at which something else was said, None if there is none.

    Args:
        recorded: what was said, with its times and lines.
        replayed: what is said now, with its times.
        nothing: empty traffic.
    """
    silence = (NEVER, nothing, 0)
    for then, now in zip_longest(recorded, replayed, fillvalue=silence):
        if then[:2] != now[:2]:
            first_us = min(then[0], now[0])
            _, old, line = then if then[0] == first_us else silence
            return Difference(first_us, old, now[1] if now[0] == first_us else nothing, line)
    return None
