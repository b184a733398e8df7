"""What the doors of a bench tell of the host that goes through them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from time import monotonic_ns
from typing import Any, Protocol

from tickrig.host.text.trace import Mark
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorFrame

Seen = tuple[CanFrame | ErrorFrame, ...]
"""What passes a door of a bus."""


class DoorWatch(Protocol):
    """Who is told what passes a door, and how the host keeps time."""

    def used(self) -> None:
        """Take note that the host is about to send or to wait; may forbid it by raising."""

    def waited(self, wanted_us: int, took_us: int) -> None:
        """Take note of a wait in vain: how long it was to take, and how long it took."""

    def sending(self, traffic: Any) -> AbstractContextManager[object]:
        """Return what is entered while bytes or frames are sent, which other doors may see."""
        ...

    def passed(self, mark: Mark, traffic: Any) -> None:
        """Take note of bytes or frames."""


def _now_us() -> int:
    return monotonic_ns() // 1_000


class HostPace:
    """How late a host was in its waits.

    Attributes:
        late_us: the worst so far.
    """

    def __init__(self, now_us: Callable[[], int] = _now_us) -> None:
        self._now_us, self.late_us = now_us, 0

    def waited(self, wanted_us: int, took_us: int) -> None:
        """Take note of a wait in vain."""
        self.late_us = max(self.late_us, took_us - wanted_us)

    def sending(self, traffic: object) -> AbstractContextManager[object]:
        """Nothing: it is of no matter here who sees what is sent."""
        return nullcontext()

    @contextmanager
    def waiting(self, wanted_us: int) -> Iterator[None]:
        """Take note of what is waited for inside, which ends by itself in time."""
        begun_us = self._now_us()
        yield
        self.waited(wanted_us, self._now_us() - begun_us)
