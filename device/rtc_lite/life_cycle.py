"""The life cycle of the component on the device (OMG RTC 1.0, ported by the paper's Fig. 3)."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

from tickrig.device.component import CallbackRunner
from tickrig.device.rtc_lite.component import LiteComponent
from tickrig.wire.rtc_lite.codes import LiteCommand, LiteState, LiteStatus


class _LiteTransition(NamedTuple):
    """Effect of a command, with the allowed state, the callback and the next state."""

    begin: LiteState
    callback: str
    good: LiteState
    bad: LiteState


_TRANSITIONS: Final[Mapping[LiteCommand, _LiteTransition]] = MappingProxyType(
    {
        LiteCommand.INITIALIZE: _LiteTransition(
            LiteState.CREATED, "on_initialize", LiteState.INACTIVE, LiteState.CREATED
        ),
        LiteCommand.ACTIVATE: _LiteTransition(
            LiteState.INACTIVE, "on_activated", LiteState.ACTIVE, LiteState.ERROR
        ),
        LiteCommand.EXECUTE: _LiteTransition(
            LiteState.ACTIVE, "on_execute", LiteState.ACTIVE, LiteState.ERROR
        ),
        LiteCommand.DEACTIVATE: _LiteTransition(
            LiteState.ACTIVE, "on_deactivated", LiteState.INACTIVE, LiteState.ERROR
        ),
        LiteCommand.ERROR: _LiteTransition(
            LiteState.ERROR, "on_error", LiteState.ERROR, LiteState.ERROR
        ),
        LiteCommand.RESET: _LiteTransition(
            LiteState.ERROR, "on_reset", LiteState.INACTIVE, LiteState.ERROR
        ),
        LiteCommand.FINALIZE: _LiteTransition(
            LiteState.INACTIVE, "on_finalize", LiteState.NONE, LiteState.INACTIVE
        ),
    }
)

_CONTEXT_CALLBACKS: Final = {
    LiteCommand.STARTUP: "on_startup",
    LiteCommand.SHUTDOWN: "on_shutdown",
}
"""Callbacks without a change of state; a component that does not define them answers `!`."""

_NOT_ALIVE: Final = (LiteState.CREATED, LiteState.NONE)


class LiteLifeCycle(CallbackRunner[LiteComponent]):
    """Life cycle of an RTComponent-Lite: executes commands, runs callbacks and keeps the state.

    Attributes:
        state: present state of the component.
    """

    def __init__(self, component: LiteComponent) -> None:
        super().__init__(component)
        self.state = LiteState.CREATED

    def obey(self, command: LiteCommand) -> LiteStatus:
        """Execute a life cycle command."""
        if command is LiteCommand.ABORT:
            return self._abort_at_once()
        if command in _CONTEXT_CALLBACKS:
            return self._notify(_CONTEXT_CALLBACKS[command])
        move = _TRANSITIONS[command]
        if self.state is not move.begin:
            return LiteStatus.WRONG_STATE
        if self.call(move.callback):
            self.state = move.good
            return LiteStatus.OK
        # If on_reset or on_error fails, the component stays in Error. It does not enter Error
        # again, so on_aborting is not called (vector L05). If on_initialize or on_finalize fails,
        # the state does not change.
        if move.bad is LiteState.ERROR and move.begin is not LiteState.ERROR:
            self._enter_error(left=move.callback == "on_deactivated")
        self.state = move.bad
        return LiteStatus.ERROR

    def _abort_at_once(self) -> LiteStatus:
        if self.state is not LiteState.ACTIVE:
            return LiteStatus.WRONG_STATE
        self._enter_error()
        self.state = LiteState.ERROR
        return LiteStatus.OK

    def _enter_error(self, *, left: bool = False) -> None:
        """Run the exit action of Active unless it has failed, then `on_aborting`."""
        # First the exit action of Active, then on_aborting, in the order of UML (DECISION L3,
        # vectors L04 and L06). If on_deactivated has just failed, it is not called a second time
        # (L14).
        if not left:
            self.call("on_deactivated")
        self.call("on_aborting")

    def _notify(self, callback: str) -> LiteStatus:
        if getattr(type(self.component), callback) is getattr(LiteComponent, callback):
            return LiteStatus.UNSUPPORTED
        if self.state in _NOT_ALIVE:
            return LiteStatus.WRONG_STATE
        return LiteStatus.OK if self.call(callback) else LiteStatus.ERROR
