"""Moves between states for callers that wait, as those of OpenRTM do."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Final

from tickrig.host.rtc.execution.execution_context import ExecutionContext
from tickrig.host.rtc.remote.call_queue import CALL_TIMEOUT_US, CallQueue
from tickrig.host.rtc.states import LifeCycleState, ReturnCode, RtcRefused

if TYPE_CHECKING:
    from tickrig.host.rtc.component import RtComponent

Request = Callable[[ExecutionContext, "RtComponent"], ReturnCode]

_WANTED: Final[dict[Request, LifeCycleState]] = {
    ExecutionContext.activate_component: LifeCycleState.ACTIVE,
    ExecutionContext.deactivate_component: LifeCycleState.INACTIVE,
    ExecutionContext.reset_component: LifeCycleState.INACTIVE,
}


def move(
    calls: CallQueue,
    context: ExecutionContext,
    component: RtComponent,
    request: Request,
    timeout_us: int = CALL_TIMEOUT_US,
) -> ReturnCode:
    """Ask for a move and wait for its end; in any thread but that of the manager.

    Args:
        calls: those of the manager's thread.
        context: the execution context.
        component: which takes part in it.
        request: `ExecutionContext.activate_component`, `deactivate_component` or
            `reset_component`.
        timeout_us: how long to wait, first for the manager's thread, then for the end.

    Returns:
        What the request gives if it is refused; RTC_OK if the component is where it was to go
        to; RTC_ERROR if the callback failed, or it went elsewhere, or is not there in time.

    Raises:
        TimeoutError: the manager's thread had no time; then nothing was asked for.
        RtcRefused: the system has ended.
    """
    wanted, future = _WANTED[request], Future[ReturnCode]()

    def moved(other: RtComponent, state: LifeCycleState, code: ReturnCode) -> None:
        if other is component and not future.done():
            there = code is ReturnCode.RTC_OK and state is wanted
            future.set_result(ReturnCode.RTC_OK if there else ReturnCode.RTC_ERROR)

    def begin() -> ReturnCode:
        code = request(context, component)
        if code is ReturnCode.RTC_OK:
            context.on_move.append(moved)
        return code

    code = calls.call(begin, timeout_us)
    if code is not ReturnCode.RTC_OK:
        return code
    try:
        return future.result(timeout_us / 1e6)
    except TimeoutError:
        return ReturnCode.RTC_ERROR
    finally:
        with suppress(RtcRefused):  # the system has ended
            calls.post(partial(context.on_move.remove, moved))
