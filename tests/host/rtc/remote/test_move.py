"""Moves between states for a caller that waits, in another thread."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest

from tests.host.rtc.spy import ERROR, OK, PERIOD_US, Bench, BrokenError
from tickrig.host.rtc import ExecutionContext, ReturnCode
from tickrig.host.rtc.engines.openrtm.context import Request, move
from tickrig.host.rtc.system.call_queue import CallQueue

activate = ExecutionContext.activate_component
deactivate = ExecutionContext.deactivate_component
reset = ExecutionContext.reset_component
FAILED = BrokenError("failed")
LONG_US = 30_000_000


class Desk:
    """A spy, and a thread that asks for its moves."""

    def __init__(self, pool: ThreadPoolExecutor) -> None:
        self.bench, self.calls, self._pool = Bench(), CallQueue(), pool

    def move(self, request: Request, timeout_us: int = LONG_US, *, runs: bool = True) -> ReturnCode:
        ec, spy = self.bench.ec, self.bench.spy
        future = self._pool.submit(move, self.calls, ec, spy, request, timeout_us)
        while not future.done():
            self.calls.serve(1_000)
            if runs:
                ec.tick(ec.now_us + PERIOD_US)
        self.calls.serve(0)
        assert ec.on_move == []
        return future.result()


@pytest.fixture
def desk() -> Iterator[Desk]:
    with ThreadPoolExecutor(1) as pool:
        desk = Desk(pool)
        yield desk
        desk.calls.close()


def state(desk: Desk) -> str:
    return desk.bench.ec.state_of(desk.bench.spy).name


def test_it_returns_when_the_component_is_there(desk: Desk) -> None:
    assert (desk.move(activate), state(desk)) == (OK, "ACTIVE")
    assert (desk.move(deactivate), state(desk)) == (OK, "INACTIVE")
    desk.bench.bring("ERROR")
    assert (desk.move(reset), state(desk)) == (OK, "INACTIVE")


@pytest.mark.parametrize("failure", [ReturnCode.UNSUPPORTED, FAILED], ids=["returns", "raises"])
@pytest.mark.parametrize(
    ("request_", "before", "callback"),
    [
        (activate, "INACTIVE", "on_activated"),
        (deactivate, "ACTIVE", "on_deactivated"),
        (reset, "ERROR", "on_reset"),
    ],
)
def test_a_callback_that_fails_is_an_error(
    desk: Desk, request_: Request, before: str, callback: str, failure: ReturnCode | Exception
) -> None:
    desk.bench.bring(before)
    desk.bench.spy.results[callback] = failure
    assert desk.move(request_) is ERROR
    desk.bench.period()
    assert state(desk) == "ERROR"


def test_what_is_refused_is_not_waited_for(desk: Desk) -> None:
    assert desk.move(reset, runs=False) is ReturnCode.PRECONDITION_NOT_MET
    assert desk.move(deactivate, runs=False) is ReturnCode.PRECONDITION_NOT_MET


def test_a_component_that_goes_elsewhere_is_an_error(desk: Desk) -> None:
    aborted = [False]

    def abort_too(context: ExecutionContext, component: object) -> ReturnCode:
        code = activate(context, desk.bench.spy)
        aborted[0] = True
        context.abort_component(desk.bench.spy)
        return code

    with pytest.raises(KeyError):
        move(desk.calls, desk.bench.ec, desk.bench.spy, abort_too)
    assert aborted == [False]
    desk.bench.bring("ACTIVE")
    desk.bench.spy.results["on_execute"] = ERROR
    desk.bench.ec.tick(desk.bench.ec.now_us + PERIOD_US)  # on its way to Error
    assert desk.move(deactivate) is ReturnCode.PRECONDITION_NOT_MET


def test_a_component_that_leaves_is_an_error(desk: Desk) -> None:
    desk.bench.bring("ERROR")
    desk.calls.post(lambda: desk.calls.post(desk.bench.spy.exit))
    assert desk.move(reset, runs=False) is ERROR


def test_a_context_that_stands_still_is_an_error_in_time(desk: Desk) -> None:
    desk.bench.ec.stop()
    assert desk.move(activate, 20_000) is ERROR
