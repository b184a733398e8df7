"""A schedule in real time: somebody waits for what is due, and ticks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol

from tickrig.host.rtc.system.schedule import Schedule

LATE_US: Final = 1_000
"""A tick that begins later than this counts as late."""

PAUSE_US: Final = 20_000
"""The longest wait: so soon something is noticed that came to be due meanwhile, or a stop."""


class Clock(Protocol):
    """Time since it was first waited for, in microseconds."""

    def wait_until(self, t_us: int, /) -> int:
        """Return when it is `t_us`; the answer is how late in microseconds, 0 if on time."""
        ...


class RealTime:
    """Runs a schedule by a clock; what is late is made up for, no period is skipped.

    Periods that are late run one after the other, each with the time at which
    it was due. A system that always takes longer than its periods falls behind
    for good, and `worst_late_us` says so.

    Args:
        schedule: what is run, from its present on.
        clock: waits, and may serve somebody meanwhile.

    Attributes:
        running: False once `stop` was called.
        late_ticks: how many ticks began more than `LATE_US` late.
        worst_late_us: by how much the worst of them was late.
        after_tick: called with the time in us after each tick.
    """

    def __init__(self, schedule: Schedule, clock: Clock) -> None:
        self._schedule, self._clock = schedule, clock
        self._start_us = schedule.now_us
        self.running, self.late_ticks, self.worst_late_us = True, 0, 0
        self.after_tick: list[Callable[[int], None]] = []

    def run(self) -> None:
        """Run until somebody calls `stop`: a callback, a listener, or what the clock serves."""
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
