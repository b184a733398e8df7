"""Operations that wait for conditions, with several operations at once."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Generator, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Until:
    """Awaitable with which an operation of a drive waits until a condition holds.

    Attributes:
        done: function that returns whether the condition holds.
        within_us: time limit in microseconds.
        complaint: message of the `DriveFailed` error if the condition does not hold within the time
            limit.
    """

    done: Callable[[], bool]
    within_us: int
    complaint: str

    def __await__(self) -> Generator[Until, None, None]:
        """Wait. Raise DriveFailed if the condition does not hold in time."""
        yield self


Operation = Coroutine[Until, None, Any]
"""An operation that takes time. It awaits `Until` and other operations. `perform` runs it."""


class DriveFailed(Exception):  # noqa: N818 - what the drive did
    """A drive did not complete an operation in time, or cannot do it."""


class _Wait:
    """An operation, and the condition that it waits for."""

    def __init__(self, operation: Operation, now_us: int) -> None:
        self._operation = operation
        self.step: Until | None = None
        self._deadline_us = now_us
        self._take(now_us, None)

    def due(self, now_us: int) -> bool:
        """Whether the operation can continue."""
        return self.step is not None and (self.step.done() or now_us >= self._deadline_us)

    def left_us(self, now_us: int) -> int:
        """Return the remaining time of the wait."""
        return max(0, self._deadline_us - now_us)

    def go_on(self, now_us: int) -> None:
        """Run the next steps of the operation. Errors of the operation are raised."""
        step = self.step
        assert step is not None
        self._take(now_us, None if step.done() else DriveFailed(step.complaint))

    def _take(self, now_us: int, error: DriveFailed | None) -> None:
        try:
            if error is None:
                self.step = self._operation.send(None)
            else:
                self.step = self._operation.throw(error)
        except StopIteration:
            self.step = None
        else:
            self._deadline_us = now_us + self.step.within_us


def perform(
    operations: Sequence[Operation],
    now_us: Callable[[], int],
    wait_until: Callable[[Callable[[], bool], int], object],
) -> None:
    """Run several operations of drives in parallel, until all have ended.

    Raises:
        DriveFailed: an operation exceeded its time limit, or cannot be done. The other operations
            stop where they are.
    """
    waits = [_Wait(operation, now_us()) for operation in operations]
    while waits := [wait for wait in waits if wait.step is not None]:
        _wait(waits, now_us, wait_until)


def _wait(
    waits: Sequence[_Wait],
    now_us: Callable[[], int],
    wait_until: Callable[[Callable[[], bool], int], object],
) -> None:
    """Wait until an operation can continue. Continue all operations that can."""
    left_us = min(wait.left_us(now_us()) for wait in waits)
    wait_until(lambda: any(wait.due(now_us()) for wait in waits), left_us)
    for wait in waits:
        if wait.due(now_us()):
            wait.go_on(now_us())
