"""The life cycle of the component on the device (OMG RTC 1.0, ported by the paper's Fig. 3)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final, NamedTuple

from tickrig.device.rtc_lite.component import ERROR, Component, Result
from tickrig.wire.rtc_lite.codes import Command, State, Status


class Move(NamedTuple):
    """What a command does: in which state, which callback, and where that leads."""

    begin: State
    callback: str
    good: State
    bad: State


MOVES: Final[Mapping[Command, Move]] = MappingProxyType(
    {
        Command.INITIALIZE: Move(State.CREATED, "on_initialize", State.INACTIVE, State.CREATED),
        Command.ACTIVATE: Move(State.INACTIVE, "on_activated", State.ACTIVE, State.ERROR),
        Command.EXECUTE: Move(State.ACTIVE, "on_execute", State.ACTIVE, State.ERROR),
        Command.DEACTIVATE: Move(State.ACTIVE, "on_deactivated", State.INACTIVE, State.ERROR),
        Command.ERROR: Move(State.ERROR, "on_error", State.ERROR, State.ERROR),
        Command.RESET: Move(State.ERROR, "on_reset", State.INACTIVE, State.ERROR),
        Command.FINALIZE: Move(State.INACTIVE, "on_finalize", State.NONE, State.INACTIVE),
    }
)

CONTEXT_CALLBACKS: Final = {
    Command.STARTUP: "on_startup",
    Command.SHUTDOWN: "on_shutdown",
}
"""They change no state, and are optional: `!` from a component that does not define them."""

NOT_ALIVE: Final = (State.CREATED, State.NONE)


@dataclass(slots=True)
class LifeCycle:
    """Runs the callbacks of a component, and keeps its state.

    Attributes:
        component: the component.
        state: its state.
        latest: name of the callback that ran last, empty before the first.
        calls: how many callbacks ran.
        executed: how many of them were `on_execute`.
    """

    component: Component
    state: State = field(default=State.CREATED, init=False)
    latest: str = field(default="", init=False)
    calls: int = field(default=0, init=False)
    executed: int = field(default=0, init=False)

    def obey(self, command: Command) -> Status:
        """Do what a command of the life cycle asks for."""
        if command is Command.ABORT:
            return self._abort_at_once()
        if command in CONTEXT_CALLBACKS:
            return self._tell(CONTEXT_CALLBACKS[command])
        move = MOVES[command]
        if self.state is not move.begin:
            return Status.WRONG_STATE
        if self._call(move.callback):
            self.state = move.good
            return Status.OK
        if move.bad is State.ERROR and move.begin is not State.ERROR:
            self._enter_error(left=move.callback == "on_deactivated")
        self.state = move.bad
        return ERROR

    def _abort_at_once(self) -> Status:
        if self.state is not State.ACTIVE:
            return Status.WRONG_STATE
        self._enter_error()
        self.state = State.ERROR
        return Status.OK

    def _enter_error(self, *, left: bool = False) -> None:
        """Run the exit action of Active unless that is what failed, then `on_aborting`."""
        if not left:
            self._call("on_deactivated")
        self._call("on_aborting")

    def _tell(self, callback: str) -> Status:
        if getattr(type(self.component), callback) is getattr(Component, callback):
            return Status.UNSUPPORTED
        if self.state in NOT_ALIVE:
            return Status.WRONG_STATE
        return Status.OK if self._call(callback) else ERROR

    def _call(self, callback: str) -> bool:
        """Run a callback; False if it failed."""
        self.latest = callback
        self.calls += 1
        self.executed += callback == "on_execute"
        result: Result = getattr(self.component, callback)()
        return result in (None, Status.OK)
