"""Execution contexts and pushing connectors of one system, run by time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, Protocol

from tickrig.host.rtc.component import ExecutionContext, ExecutionContexts
from tickrig.host.rtc.ports.connector import Connector


class ScheduledItem(Protocol):
    """Something that a schedule ticks beside execution contexts and connectors."""

    @property
    def due_us(self) -> int:
        """When `tick` has something to do; `NEVER` if that is not known."""
        ...

    def tick(self, now_us: int, /) -> None:
        """Go on to `now_us`."""


class Schedule:
    """Executes due items. It has no clock: `tick` takes the time.

    A tick has four steps: other items run, then the execution contexts in the order in which they
    were added, then connectors push, then deferred calls run. In virtual time `run_to` ticks; in
    real time `RealTime` waits for `due_us` and ticks.

    Attributes:
        now_us: the time of the latest tick, in us.
    """

    def __init__(self) -> None:
        self.now_us = 0
        self._items: tuple[ScheduledItem, ...] = ()
        self._contexts = ExecutionContexts()
        self._publishing: list[Connector[Any]] = []
        self._deferred: list[Callable[[], None]] = []
        self._ticking = False

    @property
    def due_us(self) -> int:
        """The next time at which there is something to do; the present if it is overdue."""
        due_us = self._contexts.due_us
        for connector in self._publishing:
            due_us = min(due_us, connector.due_us)
        for item in self._items:
            due_us = min(due_us, item.due_us)
        return max(due_us, self.now_us)

    def tick(self, now_us: int) -> None:
        """Advance the time, and run all items that are due.

        Args:
            now_us: the current time; never less than before.

        A caller that skips a `due_us` skips its periods: each execution context runs one at most.
        """
        self.now_us, self._ticking = now_us, True
        for item in self._items:
            item.tick(now_us)
        self._contexts.tick(now_us)
        for connector in self._publishing:
            connector.tick(now_us)
        self._ticking = False
        while self._deferred:
            self._deferred.pop(0)()

    def run_to(self, t_us: int) -> None:
        """Run all items that are due until a time, including that time, without waiting.

        Args:
            t_us: the time.
        """
        while (due_us := self.due_us) <= t_us:
            self.tick(due_us)
            if due_us == t_us:
                return
        self.tick(t_us)

    def run_for(self, duration_us: int) -> None:
        """Run all items that are due in the following time, without waiting.

        Args:
            duration_us: length of this time.
        """
        self.run_to(self.now_us + duration_us)

    def defer(self, action: Callable[[], None]) -> None:
        """Call an action at once, or at the end of the tick if a tick is running.

        Args:
            action: the action.
        """
        if self._ticking:
            self._deferred.append(action)
        else:
            action()

    def add_context(self, context: ExecutionContext) -> None:
        """Run an execution context from now on; one that is run already is no error."""
        self._contexts.add(context, self.now_us)

    def remove_context(self, context: ExecutionContext) -> None:
        """Run an execution context no more."""
        self._contexts.remove(context)

    def add_item(self, item: ScheduledItem) -> None:
        """Add an item that is ticked from now on.

        Args:
            item: an object with a due time and a `tick`.
        """
        self._items += (item,)

    def remove_item(self, item: ScheduledItem) -> None:
        """Tick an item no more; one that is not ticked is no error."""
        self._items = tuple(other for other in self._items if other is not item)

    def add_connector(self, connector: Connector[Any]) -> None:
        """Let a connector push from now on, if it pushes later than it is written to."""
        self._publishing = [other for other in self._publishing if other.joined]
        if connector.publishes:
            self._publishing.append(connector)


# A schedule in real time: wait until an item is due, then tick.

LATE_US: Final = 1_000
"""A tick that begins later than this counts as late."""

PAUSE_US: Final = 20_000
"""The longest wait, so that items that become due earlier, or a stop, are noticed."""


class Clock(Protocol):
    """Time since it was first waited for, in microseconds."""

    def wait_until(self, t_us: int, /) -> int:
        """Return when it is `t_us`; the answer is how late in microseconds, 0 if on time."""
        ...


class RealTime:
    """Runs a schedule by a clock; late periods are caught up, none is skipped.

    Late periods run one after the other, each with the time at which it was due. If a system always
    takes longer than its periods, its delay grows, as `worst_late_us` shows.

    Args:
        schedule: the schedule, from its current time on.
        clock: waits, and may serve clients while it waits.

    Attributes:
        running: False once `stop` was called.
        late_ticks: number of ticks that began more than `LATE_US` late.
        worst_late_us: the largest delay of a tick.
        after_tick: called with the time in us after each tick.
    """

    def __init__(self, schedule: Schedule, clock: Clock) -> None:
        self._schedule, self._clock = schedule, clock
        self._start_us = schedule.now_us
        self.running, self.late_ticks, self.worst_late_us = True, 0, 0
        self.after_tick: list[Callable[[int], None]] = []

    def run(self) -> None:
        """Run until `stop` is called: by a callback, a listener, or a client of the clock."""
        while self.running:
            self.step()

    def step(self) -> None:
        """Wait for the next tick, 20 ms at most, and run what is due."""
        schedule = self._schedule
        until_us = min(schedule.due_us, schedule.now_us + PAUSE_US)
        late_us = self._clock.wait_until(until_us - self._start_us)
        self.worst_late_us = max(self.worst_late_us, late_us)
        self.late_ticks += late_us > LATE_US
        schedule.run_to(until_us)
        for listener in tuple(self.after_tick):
            listener(until_us)

    def stop(self) -> None:
        """End `run` after the present step."""
        self.running = False
