"""Operations that wait for conditions, several at once."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Generator, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Until:
    """Wait until something is so.

    Attributes:
        done: says whether it is.
        within_us: for how long at most.
        complaint: what is raised then, as `DriveFailed`.
    """

    done: Callable[[], bool]
    within_us: int
    complaint: str

    def __await__(self) -> Generator[Until, None, None]:
        """Wait; raises DriveFailed if it is not so in time."""
        yield self


Operation = Coroutine[Until, None, Any]
"""What takes its time: it awaits `Until` and other operations, and `perform` runs it."""


class DriveFailed(Exception):  # noqa: N818 - what the drive did
    """A drive did not do in time what was wanted of it, or cannot."""


class _Wait:
    """An operation, and what it waits for now."""

    def __init__(self, operation: Operation, now_us: int) -> None:
        self._operation = operation
        self.step: Until | None = None
        self._deadline_us = now_us
        self._take(now_us, None)

    def due(self, now_us: int) -> bool:
        """Whether it can go on."""
        return self.step is not None and (self.step.done() or now_us >= self._deadline_us)

    def left_us(self, now_us: int) -> int:
        """Return for how long it waits at most."""
        return max(0, self._deadline_us - now_us)

    def go_on(self, now_us: int) -> None:
        """Let it take its next steps; raises what it raises."""
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
    """Run operations to their ends, all at once.

    Raises:
        DriveFailed: one did not get what it waited for; the others are left where they are.
    """
    waits = [_Wait(operation, now_us()) for operation in operations]
    while waits := [wait for wait in waits if wait.step is not None]:
        _wait(waits, now_us, wait_until)


def _wait(
    waits: Sequence[_Wait],
    now_us: Callable[[], int],
    wait_until: Callable[[Callable[[], bool], int], object],
) -> None:
    """Wait until one can go on; let all go on that can."""
    left_us = min(wait.left_us(now_us()) for wait in waits)
    wait_until(lambda: any(wait.due(now_us()) for wait in waits), left_us)
    for wait in waits:
        if wait.due(now_us()):
            wait.go_on(now_us())
