from __future__ import annotations

import math

import pytest

from tests.host.rtc.spy import OK, PERIOD_US, Bench, Spy
from tickrig.host.rtc import ExecutionContext, ExecutionKind, LifeCycleState, ReturnCode
from tickrig.wire.instant import NEVER

REFUSED = ReturnCode.PRECONDITION_NOT_MET
IMPOSSIBLE_HZ = [0.0, -1.0, 1_000_001.0, math.inf, math.nan]


def test_start_and_stop_tell_every_participant_and_keep_its_state() -> None:
    bench = Bench()
    bench.bring("ACTIVE")
    assert bench.ec.start() is REFUSED
    assert bench.ec.stop() is OK
    assert bench.ec.stop() is REFUSED
    assert bench.spy.taken() == ["on_shutdown"]
    assert bench.ec.state_of(bench.spy) is LifeCycleState.ACTIVE
    assert bench.ec.start() is OK
    assert bench.spy.taken() == ["on_startup"]


def test_no_callback_runs_while_it_is_stopped() -> None:
    bench = Bench()
    bench.bring("ACTIVE")
    bench.ec.stop()
    bench.spy.taken()
    assert bench.ec.due_us == NEVER
    assert bench.ec.deactivate_component(bench.spy) is OK
    bench.ec.tick(10 * PERIOD_US)
    assert bench.spy.taken() == []
    bench.ec.start()
    assert bench.ec.due_us == 11 * PERIOD_US
    assert bench.period() == ["on_startup", "on_deactivated"]


def test_it_does_not_start_with_a_participant_that_is_not_alive() -> None:
    ec, spy = ExecutionContext(), Spy()
    ec.add_component(spy)
    assert ec.start() is REFUSED
    spy.initialize()
    assert ec.start() is OK


def test_periods_fall_on_the_multiples_of_the_period() -> None:
    ec = ExecutionContext(400.0)
    ec.tick(1_234)
    ec.start()
    times = []
    for _ in range(3):
        times.append(ec.due_us)
        ec.tick(ec.due_us)
    assert times == [2_500, 5_000, 7_500]


def test_a_tick_before_it_is_due_runs_nothing() -> None:
    bench = Bench()
    bench.bring("ACTIVE")
    bench.ec.tick(bench.ec.due_us - 1)
    assert bench.spy.taken() == []


def test_set_rate_changes_the_period_and_tells_every_participant() -> None:
    bench = Bench()
    assert bench.ec.set_rate(100.0) is OK
    assert bench.spy.taken() == ["on_rate_changed"]
    assert (bench.ec.rate_hz, bench.ec.period_us, bench.ec.due_us) == (100.0, 10_000, 10_000)


def test_set_rate_while_stopped_does_not_start_it() -> None:
    ec = ExecutionContext()
    assert ec.set_rate(10.0) is OK
    assert ec.due_us == NEVER


@pytest.mark.parametrize(
    ("rate_hz", "period_us"),
    [(1_000_000.0, 1), (3.0, 333_333), (1.0, 1_000_000), (1e-6, 1_000_000_000_000)],
)
def test_the_first_period_begins_a_period_after_the_start(rate_hz: float, period_us: int) -> None:
    ec = ExecutionContext(rate_hz)
    assert (ec.period_us, ec.start(), ec.due_us) == (period_us, OK, period_us)


@pytest.mark.parametrize("rate_hz", IMPOSSIBLE_HZ)
def test_a_rate_that_cannot_be_is_refused(rate_hz: float) -> None:
    bench = Bench()
    assert bench.ec.set_rate(rate_hz) is ReturnCode.BAD_PARAMETER
    assert (bench.ec.rate_hz, bench.spy.taken()) == (1_000.0, [])
    with pytest.raises(ValueError, match="rate"):
        ExecutionContext(rate_hz)


def test_a_component_takes_part_once() -> None:
    ec, spy = ExecutionContext(), Spy()
    assert ec.add_component(spy) is OK
    assert ec.add_component(spy) is REFUSED
    assert ec.components == (spy,)
    assert spy.own(ec) is REFUSED
    assert spy.own_contexts == []


@pytest.mark.parametrize("operation", ["activate", "deactivate", "reset", "abort"])
def test_an_operation_on_a_stranger_or_a_dead_one_is_a_bad_parameter(operation: str) -> None:
    ec, stranger, dead = ExecutionContext(), Spy(), Spy("Dead")
    stranger.initialize()
    ec.add_component(dead)
    for spy in (stranger, dead):
        ask = getattr(ec, f"{operation}_component")
        assert ask(spy) is ReturnCode.BAD_PARAMETER
        assert ec.state_of(spy) is LifeCycleState.CREATED


@pytest.mark.parametrize(("state", "code"), [("INACTIVE", OK), ("ACTIVE", REFUSED), ("ERROR", OK)])
def test_a_component_is_removed_unless_it_is_active(state: str, code: ReturnCode) -> None:
    bench = Bench()
    bench.bring(state)
    assert bench.ec.remove_component(bench.spy) is code
    assert (bench.spy in bench.ec.components) is (code is not OK)
    assert (bench.ec in bench.spy.contexts) is (code is not OK)


def test_a_component_that_was_removed_may_be_added_again() -> None:
    bench = Bench()
    bench.ec.remove_component(bench.spy)
    assert bench.ec.add_component(bench.spy) is OK
    assert bench.ec.components == (bench.spy,)


def test_a_rate_whose_period_is_not_allowed_is_refused() -> None:
    ec = ExecutionContext(100.0)
    ec.allows_period = lambda period_us: period_us % 1_000 == 0
    assert ec.set_rate(3_000.0) is ReturnCode.BAD_PARAMETER
    assert ec.rate_hz == 100.0
    assert ec.set_rate(500.0) is OK
    assert ec.period_us == 2_000


def test_an_active_component_is_released_with_its_callback() -> None:
    bench = Bench()
    bench.bring("ACTIVE")
    assert bench.ec.release_component(bench.spy) is OK
    assert bench.spy.taken() == ["on_deactivated"]
    assert (bench.ec.components, bench.ec in bench.spy.contexts) == ((), False)


def test_closing_deactivates_stops_and_lets_all_go() -> None:
    bench = Bench()
    bench.bring("ACTIVE")
    bench.ec.close()
    assert bench.spy.taken() == ["on_deactivated", "on_shutdown"]
    assert (bench.ec.running, bench.ec.components, bench.spy.contexts) == (False, (), [])


def test_a_stranger_is_not_removed() -> None:
    ec, spy = ExecutionContext(), Spy()
    assert ec.remove_component(spy) is ReturnCode.BAD_PARAMETER
    assert ec.release_component(spy) is ReturnCode.BAD_PARAMETER


def test_a_component_has_a_state_of_its_own_in_each_context() -> None:
    spy, first, second = Spy(), ExecutionContext(), ExecutionContext(500.0)
    spy.initialize()
    for ec in (first, second):
        ec.add_component(spy)
        ec.start()
    first.activate_component(spy)
    first.tick(PERIOD_US)
    assert first.state_of(spy) is LifeCycleState.ACTIVE
    assert second.state_of(spy) is LifeCycleState.INACTIVE
    assert spy.contexts == [first, second]


class Stopper(Spy):
    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        ec.stop()
        return self.note("on_execute")


def test_a_callback_that_stops_the_context_ends_the_period() -> None:
    calls: list[str] = []
    ec = ExecutionContext()
    for spy in (Stopper("A", calls), Spy("B", calls)):
        spy.initialize()
        ec.add_component(spy)
        ec.activate_component(spy)
    ec.start()
    calls.clear()
    ec.tick(PERIOD_US)
    assert calls == [
        "A.on_activated",
        "B.on_activated",
        "A.on_shutdown",
        "B.on_shutdown",
        "A.on_execute",
    ]


class Remover(Spy):
    victim: Spy

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        return ec.remove_component(self.victim)


def test_a_component_removed_in_a_period_is_not_called_in_it_any_more() -> None:
    bench = Bench()
    remover = Remover("Remover")
    remover.initialize()
    ec = ExecutionContext()
    ec.add_component(remover)
    remover.victim = victim = Spy()
    victim.initialize()
    ec.add_component(victim)
    ec.start()
    ec.activate_component(remover)
    ec.abort_component(victim)
    victim.taken()
    ec.tick(PERIOD_US)
    assert victim.taken() == ["on_aborting"]
    assert ec.components == (remover,)
    assert bench.ec.kind is ExecutionKind.PERIODIC


def test_a_late_tick_runs_one_period() -> None:
    bench = Bench()
    bench.bring("ACTIVE")
    bench.ec.tick(10 * PERIOD_US + 1)
    assert bench.spy.taken() == ["on_execute", "on_state_update"]
    assert bench.ec.due_us == 11 * PERIOD_US
