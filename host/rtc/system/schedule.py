"""Execution contexts and pushing connectors of one system, which time drives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, Protocol

from tickrig.host.rtc.component import ExecutionContext, ExecutionContexts
from tickrig.host.rtc.ports.connector import Connector


class ScheduledItem(Protocol):
    """An additional object that a schedule ticks, besides execution contexts and connectors."""

    @property
    def due_us(self) -> int:
        """Time at which `tick` has work to do, or `NEVER` if that is unknown."""
        ...

    def tick(self, now_us: int, /) -> None:
        """Advance to `now_us`."""


class Schedule:
    """Runs the execution contexts and connectors of a system at their due times.

    The schedule reads no clock, because the caller passes the time to `tick`. In virtual time,
    `run_to` and `run_for` call `tick` without waiting. In real time, `RealTime` waits and calls
    `tick`.

    A tick has four steps. First the schedule ticks the items that were added with `add_item`. Then
    the execution contexts run in the order in which they were added. Then connectors push their
    values. At the end the schedule calls the functions that were passed to `defer` during the tick.

    Attributes:
        now_us: time of the latest tick in us.
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
        """Time in us at which `tick` must be called next.

        It is the present time if work is overdue.
        """
        due_us = self._contexts.due_us
        for connector in self._publishing:
            due_us = min(due_us, connector.due_us)
        for item in self._items:
            due_us = min(due_us, item.due_us)
        return max(due_us, self.now_us)

    def tick(self, now_us: int) -> None:
        """Advance the time, and run all items that are due.

        Each execution context runs at most one period in a tick. Therefore call `tick` at each
        `due_us`. Otherwise, periods are skipped.

        Args:
            now_us: current time in us, which is never less than before.
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
        """Run the system in virtual time, without waiting, up to and including a given time.

        Args:
            t_us: time in us at which the run ends.
        """
        while (due_us := self.due_us) <= t_us:
            self.tick(due_us)
            if due_us == t_us:
                return
        self.tick(t_us)

    def run_for(self, duration_us: int) -> None:
        """Run the system in virtual time, without waiting, for a given duration.

        Args:
            duration_us: duration in us.
        """
        self.run_to(self.now_us + duration_us)

    def defer(self, action: Callable[[], None]) -> None:
        """Call a function at once, or at the end of the tick if a tick is running.

        A callback can thus request a change, such as the end of its own component.

        Args:
            action: function to call.
        """
        if self._ticking:
            self._deferred.append(action)
        else:
            action()

    def add_context(self, context: ExecutionContext) -> None:
        """Run an execution context from now on. Adding a context twice has no effect."""
        self._contexts.add(context, self.now_us)

    def remove_context(self, context: ExecutionContext) -> None:
        """Stop running an execution context."""
        self._contexts.remove(context)

    def add_item(self, item: ScheduledItem) -> None:
        """Add an item that runs in each tick, before the execution contexts.

        Args:
            item: object with a due time and a method `tick`.
        """
        self._items += (item,)

    def remove_item(self, item: ScheduledItem) -> None:
        """Stop ticking an item. An item that is not ticked has no effect."""
        self._items = tuple(other for other in self._items if other is not item)

    def add_connector(self, connector: Connector[Any]) -> None:
        """Tick a connector from now on, if it pushes its values in ticks."""
        self._publishing = [other for other in self._publishing if other.joined]
        if connector.publishes:
            self._publishing.append(connector)


# A schedule in real time: wait until an item is due, then tick.

LATE_US: Final = 1_000
"""Delay above which a tick counts as late."""

PAUSE_US: Final = 20_000
"""The longest wait, so that items that become due earlier, or a stop, are noticed."""


class Clock(Protocol):
    """A clock that counts microseconds since its first wait."""

    def wait_until(self, t_us: int, /) -> int:
        """Wait until the clock has reached a time.

        Args:
            t_us: time in us.

        Returns:
            The delay in us: the time from `t_us` to the return of this method. The delay is 0 if
            the method returns on time.
        """
        ...


class RealTime:
    """A runner of a schedule in real time. Late periods are caught up, and no period is skipped.

    Late periods run one after the other, each with the time at which it was due. If a system always
    takes longer than its periods, its delay grows, as `worst_late_us` shows.

    Args:
        schedule: schedule to run, from its current time on.
        clock: clock that waits, and may serve clients while it waits.

    Attributes:
        running: whether the schedule runs, which is False once `stop` was called.
        late_ticks: number of ticks that began more than `LATE_US` late.
        worst_late_us: largest delay of a tick in us.
        after_tick: function that is called with the time in us after each tick.
    """

    def __init__(self, schedule: Schedule, clock: Clock) -> None:
        self._schedule, self._clock = schedule, clock
        self._start_us = schedule.now_us
        self.running, self.late_ticks, self.worst_late_us = True, 0, 0
        self.after_tick: list[Callable[[int], None]] = []

    def run(self) -> None:
        """Run the schedule in real time until `stop` is called.

        For example, a callback of a component or a function in `after_tick` can call `stop`.
        """
        while self.running:
            self.step()

    def step(self) -> None:
        """Wait for the next tick, at most 20 ms, and run the due items."""
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
