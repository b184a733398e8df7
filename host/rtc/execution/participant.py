"""One component in one execution context: its state, and the callbacks of each move.

| from | to | callbacks, in order |
|---|---|---|
| Inactive | Active | on_activated |
| Active | Inactive | on_deactivated; if it fails, on_aborting, and the state is Error |
| Active | Error | on_deactivated, on_aborting |
| Inactive | Error | on_aborting |
| Error | Inactive | on_reset; if it fails, the state stays Error |
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from tickrig.host.rtc.component_action import ComponentAction, failed
from tickrig.host.rtc.listeners import call_listeners
from tickrig.host.rtc.states import LifeCycleState, ReturnCode

if TYPE_CHECKING:
    from tickrig.host.rtc.component import RtComponent
    from tickrig.host.rtc.execution.execution_context import ExecutionContext

_OK: Final = ReturnCode.RTC_OK
_CREATED: Final = LifeCycleState.CREATED
_INACTIVE: Final = LifeCycleState.INACTIVE
_ACTIVE: Final = LifeCycleState.ACTIVE
_ERROR: Final = LifeCycleState.ERROR

Callback = Callable[["ExecutionContext"], ReturnCode]


class Participant:
    """A component as its execution context sees it.

    Attributes:
        state: the present state; Created after it was removed.
        wanted: the state it is to be moved to in the next pre-pass, if any.
    """

    __slots__ = ("_context", "_updates", "component", "state", "wanted")

    def __init__(self, component: RtComponent, context: ExecutionContext) -> None:
        self.component, self._context = component, context
        self.state: LifeCycleState = _INACTIVE
        self.wanted: LifeCycleState | None = None
        base = ComponentAction.on_state_update
        self._updates = type(component).on_state_update is not base

    def request(self, source: LifeCycleState, wanted: LifeCycleState) -> ReturnCode:
        """Ask for a move; PRECONDITION_NOT_MET unless in `source` and not on the way to Error."""
        if self.state is not source or self.wanted is _ERROR:
            return ReturnCode.PRECONDITION_NOT_MET
        self.wanted = wanted
        return _OK

    def abort(self) -> None:
        """Move to Error in the next pre-pass; nothing if it is there."""
        if self.state is not _ERROR:
            self.wanted = _ERROR

    def notify(self, callback: Callback) -> ReturnCode:
        """Run a callback and return its code; if it fails, Error comes next."""
        code = self._call(callback)
        if code is not _OK:
            self.abort()
        return code

    def pre(self) -> None:
        """First pass of a period: make the move that is wanted."""
        if self.component.configuration.changed:
            self.notify(self._update_configuration)
        if (wanted := self.wanted) is not None:
            self.wanted = None
            code = _MOVES[self.state, wanted](self)
            if self._context.on_move:
                self._report(code)

    def do(self) -> None:
        """Second pass of a period: the work of the state."""
        if self.state is _ACTIVE:
            if self.wanted is not _ERROR and self._call(self.component.on_execute) is not _OK:
                self.wanted = _ERROR
        elif self.state is _ERROR:
            self._call(self.component.on_error)

    def post(self) -> None:
        """Third pass of a period, after the second one of all participants."""
        if self._updates and self.state is _ACTIVE and self.wanted is not _ERROR:
            self.notify(self.component.on_state_update)

    def leave(self) -> None:
        """Leave Active at once, as a component that ends does; the state is Created."""
        code = self._call(self.component.on_deactivated) if self.state is _ACTIVE else _OK
        left, self.state, self.wanted = self.state is not _CREATED, _CREATED, None
        if left and self._context.on_move:
            self._report(code)

    def _update_configuration(self, ec: ExecutionContext) -> ReturnCode:
        self.component.configuration.update()
        return _OK

    def _report(self, code: ReturnCode) -> None:
        component, listeners = self.component, self._context.on_move
        call_listeners(component.instance_name, listeners, component, self.state, code)

    def _activate(self) -> ReturnCode:
        self.state = _ACTIVE
        return self.notify(self.component.on_activated)

    def _deactivate(self) -> ReturnCode:
        code = self._call(self.component.on_deactivated)
        if code is _OK:
            self.state = _INACTIVE
        else:
            self._enter_error()
        return code

    def _abort_active(self) -> ReturnCode:
        self._call(self.component.on_deactivated)
        return self._enter_error()

    def _enter_error(self) -> ReturnCode:
        self.state = _ERROR
        return self._call(self.component.on_aborting)

    def _reset(self) -> ReturnCode:
        code = self._call(self.component.on_reset)
        if code is _OK:
            self.state = _INACTIVE
        return code

    def _call(self, callback: Callback) -> ReturnCode:
        try:  # `guarded`, without a call for each callback
            return callback(self._context)
        except Exception:
            return failed(self.component.instance_name, callback)


_MOVES: Final[dict[tuple[LifeCycleState, LifeCycleState], Callable[[Participant], ReturnCode]]] = {
    (_INACTIVE, _ACTIVE): Participant._activate,
    (_INACTIVE, _ERROR): Participant._enter_error,
    (_ACTIVE, _INACTIVE): Participant._deactivate,
    (_ACTIVE, _ERROR): Participant._abort_active,
    (_ERROR, _INACTIVE): Participant._reset,
}
