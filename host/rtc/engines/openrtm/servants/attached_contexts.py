"""Execution contexts of a component, by handle; those of peers may call its callbacks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.component_action import guarded
from tickrig.host.rtc.engines.openrtm.orb import Reference
from tickrig.host.rtc.engines.openrtm.servants.references import References
from tickrig.host.rtc.execution.execution_context import ExecutionContext
from tickrig.host.rtc.states import ReturnCode
from tickrig.host.rtc.system.manager import Manager

PARTICIPATING: Final = 1_000
"""Handle of the first execution context that is not the component's own (OpenRTM-aist)."""

FOREIGN: Final = 2_000
NONE: Final = -1

Callback = Callable[[ExecutionContext], ReturnCode]


def _calling(name: str) -> Callable[[AttachedContexts, int], Any]:
    """Return the operation that calls a callback of the component."""

    def call(contexts: AttachedContexts, exec_handle: int) -> Any:
        return contexts.call(exec_handle, name)

    return call


class AttachedContexts:
    """Answers for the execution contexts of a component; its methods are operations of the IDL.

    A peer attaches an execution context of its own and then calls `on_activated`,
    `on_execute` and so on with the handle it was given. To the callback that context has the
    time of the manager; its rate and the states in it are the peer's matter. Nobody
    calls the callbacks of contexts that are here: PRECONDITION_NOT_MET.

    Args:
        component: whose contexts they are.
        manager: tells the time.
        references: of the execution contexts that are here.
    """

    def __init__(self, component: RtComponent, manager: Manager, references: References) -> None:
        self._component, self._manager, self._references = component, manager, references
        self._calls = references.calls
        self._foreign: dict[int, tuple[Reference, ExecutionContext]] = {}
        self._next = FOREIGN

    def get_owned_contexts(self) -> list[Reference]:
        """Return those that end with the component."""
        return self._calls.call(lambda: self._references.all_of(self._component.own_contexts))

    def get_participating_contexts(self) -> list[Reference]:
        """Return all others that it takes part in."""
        return self._calls.call(lambda: [*self._references.all_of(self._others()), *self._peers()])

    def get_context(self, exec_handle: int) -> Reference:
        """Return the context of a handle; nil if there is none."""
        return self._calls.call(lambda: self._by_handle().get(exec_handle))

    def get_context_handle(self, cxt: Reference) -> int:
        """Return the handle of a context; -1 if the component takes no part in it."""
        return self._calls.call(lambda: self._handle(cxt))

    def is_alive(self, exec_context: Reference) -> bool:
        """Return whether the component lives, and takes part in that context."""
        return self._calls.call(
            lambda: self._component.alive and self._handle(exec_context) != NONE
        )

    def attach_context(self, exec_context: Reference) -> int:
        """Take part in a context of a peer; the answer is its handle, -1 for nil."""
        return self._calls.call(lambda: self._attach(exec_context))

    def detach_context(self, exec_handle: int) -> Any:
        """Take part in a context of a peer no more."""
        return self._calls.call(lambda: self._detach(exec_handle))

    def call(self, exec_handle: int, name: str) -> Any:
        """Call a callback for an execution context of a peer."""
        return self._references.code(self._calls.call(lambda: self._called(exec_handle, name)))

    on_startup = _calling("on_startup")
    on_shutdown = _calling("on_shutdown")
    on_activated = _calling("on_activated")
    on_deactivated = _calling("on_deactivated")
    on_aborting = _calling("on_aborting")
    on_error = _calling("on_error")
    on_reset = _calling("on_reset")
    on_execute = _calling("on_execute")
    on_state_update = _calling("on_state_update")
    on_rate_changed = _calling("on_rate_changed")

    def _others(self) -> list[ExecutionContext]:
        own = self._component.own_contexts
        return [context for context in self._component.contexts if context not in own]

    def _peers(self) -> list[Reference]:
        return [reference for reference, _ in self._foreign.values()]

    def _by_handle(self) -> dict[int, Reference]:
        own, others = self._component.own_contexts, self._others()
        here = dict(enumerate(own)) | dict(enumerate(others, PARTICIPATING))
        found = {handle: self._references.of(context) for handle, context in here.items()}
        return found | {handle: entry[0] for handle, entry in self._foreign.items()}

    def _handle(self, wanted: Reference) -> int:
        if wanted is None:
            return NONE
        for handle, reference in self._by_handle().items():
            if reference is not None and reference._is_equivalent(wanted):
                return handle
        return NONE

    def _attach(self, reference: Reference) -> int:
        if reference is None or (known := self._handle(reference)) != NONE:
            return NONE if reference is None else known
        handle, self._next = self._next, self._next + 1
        self._foreign[handle] = (reference, ExecutionContext())
        return handle

    def _detach(self, handle: int) -> Any:
        if self._foreign.pop(handle, None) is not None:
            return self._references.code(ReturnCode.RTC_OK)
        here = handle in self._by_handle()
        code = ReturnCode.PRECONDITION_NOT_MET if here else ReturnCode.BAD_PARAMETER
        return self._references.code(code)

    def _called(self, handle: int, name: str) -> ReturnCode:
        if (entry := self._foreign.get(handle)) is None:
            here = handle in self._by_handle()
            return ReturnCode.PRECONDITION_NOT_MET if here else ReturnCode.BAD_PARAMETER
        _, context = entry
        context.tick(self._manager.now_us)
        callback: Callback = getattr(self._component, name)
        return guarded(self._component.instance_name, callback, context)
