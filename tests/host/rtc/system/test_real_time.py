"""Real time, on a clock that says how late it is."""

from __future__ import annotations

from collections.abc import Callable

from tests.host.rtc.chain import PERIOD_US, Chain
from tickrig.host.rtc import Manager
from tickrig.host.rtc.system.schedule import PAUSE_US, RealTime


class ScriptedClock:
    """Is late as a test wants, and does what is done while others wait."""

    def __init__(self, *late_us: int) -> None:
        self.waits: list[int] = []
        self.meanwhile: Callable[[], object] | None = None
        self._late_us = list(late_us)

    def wait_until(self, t_us: int, /) -> int:
        self.waits.append(t_us)
        if self.meanwhile is not None:
            self.meanwhile()
        return self._late_us.pop(0) if self._late_us else 0


def test_late_periods_are_made_up_for_and_counted() -> None:
    chain, clock = Chain(), ScriptedClock(0, 4_500, 3_500, 900)
    chain.source.enter(1, 2, 3, 4)
    runner = RealTime(chain.manager, clock)
    for _ in range(4):
        runner.step()
    assert chain.numbers == [1, 2, 3, 4]
    assert [value.tm.us for value in chain.sink.received] == [1_000, 2_000, 3_000, 4_000]
    assert clock.waits == [1_000, 2_000, 3_000, 4_000]
    assert (runner.late_ticks, runner.worst_late_us) == (2, 4_500)


def test_the_clock_starts_where_the_schedule_is() -> None:
    chain, clock = Chain(), ScriptedClock()
    chain.manager.run_for(70 * PERIOD_US)
    RealTime(chain.manager, clock).step()
    assert clock.waits == [1_000]
    assert chain.manager.now_us == 71_000


def test_without_anything_due_it_waits_in_pauses() -> None:
    clock = ScriptedClock()
    runner = RealTime(manager := Manager(), clock)
    runner.step()
    runner.step()
    assert clock.waits == [PAUSE_US, 2 * PAUSE_US]
    assert manager.now_us == 2 * PAUSE_US


def test_what_came_to_be_due_during_a_wait_skips_no_period() -> None:
    chain, clock = Chain(), ScriptedClock()
    for name in ("ConsoleIn0", "ConsoleOut0"):
        chain.manager.context_of(name).set_rate(10.0)
    clock.meanwhile = lambda: chain.manager.context_of("ConsoleIn0").set_rate(1_000.0)
    chain.source.enter(*range(PAUSE_US // PERIOD_US))
    RealTime(chain.manager, clock).step()
    assert not chain.source.waiting


def test_it_runs_until_it_is_stopped_and_tells_of_each_tick() -> None:
    chain = Chain()
    runner, told = RealTime(chain.manager, ScriptedClock()), list[int]()
    runner.after_tick.append(told.append)
    runner.after_tick.append(lambda now_us: runner.stop() if now_us == 3_000 else None)
    runner.run()
    assert told == [1_000, 2_000, 3_000]
    assert not runner.running
