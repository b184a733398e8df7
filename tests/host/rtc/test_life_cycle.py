"""Operation, state and callback result against the callbacks of each period and the end state.

The order within a period is that of OpenRTM-aist 1.x (pre, do, post), the
callbacks of a move those of OMG RTC 1.0.
"""

from __future__ import annotations

import logging

import pytest

from tests.host.rtc.spy import CALLBACKS, ERROR, OK, PERIOD_US, Bench, BrokenError, Spy
from tickrig.host.rtc import ExecutionContext, LifeCycleState, ReturnCode, RtComponent

OPERATIONS = ("activate", "deactivate", "reset", "abort", "none")
WORK = {
    "INACTIVE": "",
    "ACTIVE": "on_execute on_state_update",
    "ERROR": "on_error",
}
"""Callbacks of a period in which nothing else happens."""

# operation, state before: result, callbacks of the period, of the next one, state after them
DONE = [
    ("activate", "INACTIVE", OK, "on_activated on_execute on_state_update", "ACTIVE"),
    ("deactivate", "ACTIVE", OK, "on_deactivated", "INACTIVE"),
    ("reset", "ERROR", OK, "on_reset", "INACTIVE"),
    ("abort", "INACTIVE", OK, "on_aborting on_error", "ERROR"),
    ("abort", "ACTIVE", OK, "on_deactivated on_aborting on_error", "ERROR"),
    ("none", "INACTIVE", OK, "", "INACTIVE"),
    ("none", "ACTIVE", OK, "on_execute on_state_update", "ACTIVE"),
    ("none", "ERROR", OK, "on_error", "ERROR"),
]
REFUSED = [
    (operation, state)
    for operation in OPERATIONS
    for state in WORK
    if (operation, state) not in {row[:2] for row in DONE}
]

# operation, state before, callback that fails: callbacks of each period, state at the end
ABORTED = "on_deactivated on_aborting on_error"
FAILING = [
    ("activate", "INACTIVE", "on_activated", ("on_activated", ABORTED), "ERROR"),
    ("activate", "INACTIVE", "on_execute", ("on_activated on_execute", ABORTED), "ERROR"),
    (
        "activate",
        "INACTIVE",
        "on_state_update",
        ("on_activated on_execute on_state_update", ABORTED),
        "ERROR",
    ),
    ("none", "ACTIVE", "on_execute", ("on_execute", ABORTED, "on_error"), "ERROR"),
    ("none", "ACTIVE", "on_state_update", ("on_execute on_state_update", ABORTED), "ERROR"),
    ("deactivate", "ACTIVE", "on_deactivated", (ABORTED, "on_error"), "ERROR"),
    ("abort", "ACTIVE", "on_deactivated", (ABORTED, "on_error"), "ERROR"),
    ("abort", "ACTIVE", "on_aborting", (ABORTED, "on_error"), "ERROR"),
    ("abort", "INACTIVE", "on_aborting", ("on_aborting on_error", "on_error"), "ERROR"),
    ("reset", "ERROR", "on_reset", ("on_reset on_error", "on_error"), "ERROR"),
    ("none", "ERROR", "on_error", ("on_error", "on_error"), "ERROR"),
    ("start", "INACTIVE", "on_startup", ("on_aborting on_error", "on_error"), "ERROR"),
    ("stop", "ACTIVE", "on_shutdown", (ABORTED, "on_error"), "ERROR"),
    ("set_rate", "ACTIVE", "on_rate_changed", (ABORTED, "on_error"), "ERROR"),
]
FAILURES: list[ReturnCode | Exception] = [
    ERROR,
    ReturnCode.UNSUPPORTED,
    BrokenError("broken"),
]


def ask(bench: Bench, operation: str) -> ReturnCode:
    """Ask for an operation; one that restarts the context does so before the next period."""
    ec, spy = bench.ec, bench.spy
    match operation:
        case "none":
            return OK
        case "start" | "stop":
            ec.stop()
            code = ec.start()
        case "set_rate":
            code = ec.set_rate(500.0)
        case _:
            return ReturnCode(getattr(ec, f"{operation}_component")(spy))
    spy.taken()
    return code


@pytest.mark.parametrize(("operation", "state", "code", "calls", "after"), DONE)
def test_an_operation_takes_effect_in_the_next_period(
    operation: str, state: str, code: ReturnCode, calls: str, after: str
) -> None:
    bench = Bench()
    bench.bring(state)
    assert ask(bench, operation) is code
    assert bench.spy.taken() == []
    assert bench.ec.state_of(bench.spy).name == state
    assert bench.period() == calls.split()
    assert bench.ec.state_of(bench.spy).name == after
    assert bench.period() == WORK[after].split()


@pytest.mark.parametrize(("operation", "state"), REFUSED)
def test_an_operation_in_the_wrong_state_is_refused_and_changes_nothing(
    operation: str, state: str
) -> None:
    bench = Bench()
    bench.bring(state)
    assert ask(bench, operation) is ReturnCode.PRECONDITION_NOT_MET
    assert bench.period() == WORK[state].split()
    assert bench.ec.state_of(bench.spy).name == state


@pytest.mark.parametrize("failure", FAILURES, ids=["RTC_ERROR", "UNSUPPORTED", "raises"])
@pytest.mark.parametrize(("operation", "state", "failing", "periods", "after"), FAILING)
def test_a_callback_that_fails_leads_to_error(  # noqa: PLR0913, PLR0917 - one row of the table
    operation: str,
    state: str,
    failing: str,
    periods: tuple[str, ...],
    after: str,
    failure: ReturnCode | Exception,
) -> None:
    bench = Bench(**{failing: failure})
    bench.bring(state)
    assert ask(bench, operation) is OK
    for calls in periods:
        assert bench.period() == calls.split()
    assert bench.ec.state_of(bench.spy).name == after
    assert bench.period() == WORK[after].split()


def test_what_a_callback_raises_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    bench = Bench(on_execute=BrokenError("no supply"))
    bench.bring("ACTIVE")
    with caplog.at_level(logging.ERROR):
        bench.period()
    (record,) = caplog.records
    assert record.getMessage() == "Spy0: on_execute raised"
    assert record.exc_info is not None
    assert str(record.exc_info[1]) == "no supply"


def test_the_others_live_on_when_one_raises() -> None:
    calls: list[str] = []
    ec = ExecutionContext()
    spies = [Spy(f"Spy{n}", calls) for n in range(3)]
    for spy in spies:
        spy.initialize()
        ec.add_component(spy)
    ec.start()
    for spy in spies:
        ec.activate_component(spy)
    spies[1].results["on_execute"] = BrokenError()
    ec.tick(PERIOD_US)
    calls.clear()
    ec.tick(2 * PERIOD_US)
    assert [ec.state_of(spy) for spy in spies] == [
        LifeCycleState.ACTIVE,
        LifeCycleState.ERROR,
        LifeCycleState.ACTIVE,
    ]
    assert calls == [
        "Spy1.on_deactivated",
        "Spy1.on_aborting",
        "Spy0.on_execute",
        "Spy1.on_error",
        "Spy2.on_execute",
        "Spy0.on_state_update",
        "Spy2.on_state_update",
    ]


def test_each_pass_goes_over_all_components_in_the_order_of_adding() -> None:
    calls: list[str] = []
    ec = ExecutionContext()
    for name in ("B", "A"):
        spy = Spy(name, calls)
        spy.initialize()
        ec.add_component(spy)
        ec.activate_component(spy)
    ec.start()
    calls.clear()
    ec.tick(PERIOD_US)
    steps = ("on_activated", "on_execute", "on_state_update")
    assert calls == [f"{name}.{step}" for step in steps for name in ("B", "A")]


def test_a_component_on_its_way_to_error_is_not_deactivated() -> None:
    bench = Bench(on_execute=ERROR)
    bench.bring("ACTIVE")
    bench.period()
    assert bench.ec.deactivate_component(bench.spy) is ReturnCode.PRECONDITION_NOT_MET
    assert bench.period() == ABORTED.split()


def test_an_error_overrides_a_deactivation_asked_for_in_the_same_period() -> None:
    bench = Bench(on_execute=ERROR)
    bench.bring("ACTIVE")
    bench.spy.results["on_state_update"] = OK
    assert bench.ec.deactivate_component(bench.spy) is OK
    assert bench.ec.abort_component(bench.spy) is OK
    assert bench.period() == ABORTED.split()


def test_reset_works_after_a_reset_that_failed() -> None:
    bench = Bench(on_reset=ERROR)
    bench.bring("ERROR")
    bench.ec.reset_component(bench.spy)
    bench.period()
    bench.spy.results.clear()
    assert bench.ec.reset_component(bench.spy) is OK
    assert bench.period() == ["on_reset"]
    assert bench.ec.activate_component(bench.spy) is OK
    assert bench.period() == ["on_activated", "on_execute", "on_state_update"]


@pytest.mark.parametrize(
    ("operation", "state", "failing", "moved"),
    [
        ("activate", "INACTIVE", "", [("ACTIVE", OK)]),
        ("activate", "INACTIVE", "on_activated", [("ACTIVE", ERROR), ("ERROR", OK)]),
        ("deactivate", "ACTIVE", "", [("INACTIVE", OK)]),
        ("deactivate", "ACTIVE", "on_deactivated", [("ERROR", ERROR)]),
        ("reset", "ERROR", "", [("INACTIVE", OK)]),
        ("reset", "ERROR", "on_reset", [("ERROR", ERROR)]),
        ("abort", "ACTIVE", "", [("ERROR", OK)]),
        ("none", "ACTIVE", "on_execute", [("ERROR", OK)]),
    ],
)
def test_who_listens_learns_how_each_move_ended(
    operation: str, state: str, failing: str, moved: list[tuple[str, ReturnCode]]
) -> None:
    bench, seen = Bench(**({failing: ERROR} if failing else {})), list[tuple[str, ReturnCode]]()
    bench.bring(state)
    bench.ec.on_move.append(lambda component, now, code: seen.append((now.name, code)))
    assert ask(bench, operation) is OK
    bench.period()
    bench.period()
    assert seen == moved
    bench.spy.exit()
    assert [name for name, _ in seen[len(moved) :]] == ["CREATED"]


@pytest.mark.parametrize("code", [OK, ERROR])
def test_who_listens_learns_how_a_component_left(code: ReturnCode) -> None:
    bench, seen = Bench(on_deactivated=code), list[tuple[str, ReturnCode]]()
    bench.bring("ACTIVE")
    bench.ec.on_move.append(lambda component, now, code: seen.append((now.name, code)))
    bench.ec.release_component(bench.spy)
    assert seen == [("CREATED", code)]


def test_a_listener_of_moves_that_raises_is_logged_and_stops_nobody(
    caplog: pytest.LogCaptureFixture,
) -> None:
    bench = Bench()
    bench.ec.on_move.append(lambda component, now, code: 1 / 0)
    bench.bring("ACTIVE")
    assert bench.period() == ["on_execute", "on_state_update"]
    assert [record.getMessage() for record in caplog.records] == ["Spy0: a listener raised"]


@pytest.mark.parametrize("name", [name for name in CALLBACKS if name.endswith("ize")])
def test_a_callback_that_is_not_overridden_succeeds(name: str) -> None:
    assert getattr(RtComponent("Plain0"), name)() is OK


@pytest.mark.parametrize("name", [name for name in CALLBACKS if not name.endswith("ize")])
def test_a_callback_of_a_context_that_is_not_overridden_succeeds(name: str) -> None:
    assert getattr(RtComponent("Plain0"), name)(ExecutionContext()) is OK


def test_initialize_only_from_created() -> None:
    spy = Spy()
    assert spy.initialize() is OK
    assert spy.initialize() is ReturnCode.PRECONDITION_NOT_MET
    assert spy.taken() == ["on_initialize"]


@pytest.mark.parametrize("failure", FAILURES, ids=["RTC_ERROR", "UNSUPPORTED", "raises"])
def test_a_component_that_does_not_initialize_stays_created(
    failure: ReturnCode | Exception,
) -> None:
    spy, ec = Spy(), ExecutionContext()
    spy.own(ec)
    spy.results["on_initialize"] = failure
    assert spy.initialize() is (ERROR if isinstance(failure, Exception) else failure)
    assert ec.state_of(spy) is LifeCycleState.CREATED
    assert not ec.running
    spy.results.clear()
    assert spy.initialize() is OK
    assert ec.state_of(spy) is LifeCycleState.INACTIVE


def test_finalize_only_alive_and_outside_of_contexts() -> None:
    spy, ec = Spy(), ExecutionContext()
    assert spy.finalize() is ReturnCode.PRECONDITION_NOT_MET
    spy.initialize()
    ec.add_component(spy)
    assert spy.finalize() is ReturnCode.PRECONDITION_NOT_MET
    ec.remove_component(spy)
    spy.taken()
    assert spy.finalize() is OK
    assert spy.taken() == ["on_finalize"]
    assert spy.finalize() is ReturnCode.PRECONDITION_NOT_MET


def test_a_component_whose_on_finalize_raises_is_gone_all_the_same() -> None:
    spy = Spy()
    spy.initialize()
    spy.results["on_finalize"] = BrokenError()
    assert spy.finalize() is ERROR
    assert not spy.alive


@pytest.mark.parametrize(
    ("state", "calls"),
    [
        ("INACTIVE", "on_shutdown on_finalize"),
        ("ACTIVE", "on_deactivated on_shutdown on_finalize"),
        ("ERROR", "on_shutdown on_finalize"),
    ],
)
def test_exit_leaves_active_stops_and_finalizes(state: str, calls: str) -> None:
    bench = Bench()
    bench.bring(state)
    assert bench.spy.exit() is OK
    assert bench.spy.taken() == calls.split()
    assert (bench.ec.running, bench.ec.components, bench.spy.contexts) == (False, (), [])
    assert bench.spy.exit() is ReturnCode.PRECONDITION_NOT_MET


def test_a_component_that_has_exited_owns_no_context() -> None:
    bench = Bench()
    bench.spy.exit()
    assert bench.spy.own_contexts == []


def test_exit_in_created_changes_nothing() -> None:
    spy, ec = Spy(), ExecutionContext()
    spy.own(ec)
    assert spy.exit() is ReturnCode.PRECONDITION_NOT_MET
    assert (spy.own_contexts, ec.components) == ([ec], (spy,))


def test_exit_leaves_a_context_of_others_running() -> None:
    spy, other, ec = Spy(), Spy("Other"), ExecutionContext()
    for component in (spy, other):
        component.initialize()
        ec.add_component(component)
        ec.activate_component(component)
    ec.start()
    ec.tick(PERIOD_US)
    spy.taken()
    assert spy.exit() is OK
    assert spy.taken() == ["on_deactivated", "on_finalize"]
    assert ec.components == (other,)
    assert ec.state_of(other) is LifeCycleState.ACTIVE
