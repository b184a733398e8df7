"""An execution context as peers see it (OMG RTC 1.0, ExecutionContextService)."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from tickrig.host.rtc.component import ExecutionContext, RtComponent, guarded
from tickrig.host.rtc.engines.openrtm.orb import Orb, Reference
from tickrig.host.rtc.engines.openrtm.stubs import Stubs
from tickrig.host.rtc.states import LifeCycleState, ReturnCode, RtcRefused
from tickrig.host.rtc.system.call_queue import CALL_TIMEOUT_US, CallQueue
from tickrig.host.rtc.system.manager import Manager

if TYPE_CHECKING:
    from collections.abc import Iterable


# References of components and execution contexts.


@dataclass(slots=True)
class _Entry:
    thing: RtComponent | ExecutionContext
    reference: Reference


class ServantReferences:
    """Table of the components and execution contexts that other processes can call by CORBA.

    Entries are added and removed in the manager's thread. Any thread may look them up.

    Args:
        orb: ORB that serves the objects.
        stubs: stubs of Tickrig's IDL.
        calls: queue that runs calls in the manager's thread.
        fixed: whether other processes are not allowed to create and end components, and to move a
            component to another execution context.
    """

    def __init__(self, orb: Orb, stubs: Stubs, calls: CallQueue, *, fixed: bool = False) -> None:
        self.orb, self.stubs, self.calls, self.fixed = orb, stubs, calls, fixed
        self._by_id: dict[int, _Entry] = {}
        self._by_key: dict[bytes, _Entry] = {}

    def enter(
        self, thing: RtComponent | ExecutionContext, interface: str, *answers: object
    ) -> Reference:
        """Make a component or execution context callable by peers; see `Orb.serve`."""
        reference = self.orb.serve(self.stubs.skeleton(interface), *answers)
        entry = _Entry(thing, reference)
        self._by_id[id(thing)] = self._by_key[self.orb.key(reference)] = entry
        return reference

    def remove(self, thing: RtComponent | ExecutionContext) -> None:
        """Stop accepting calls for a component or execution context."""
        if (entry := self._by_id.pop(id(thing), None)) is not None:
            del self._by_key[self.orb.key(entry.reference)]
            self.orb.withdraw(entry.reference)

    def of(self, thing: RtComponent | ExecutionContext | None) -> Reference:
        """Return the reference of an object, or nil (None) if peers cannot call it."""
        entry = self._by_id.get(id(thing))
        return None if entry is None else entry.reference

    def all_of(self, things: Iterable[RtComponent | ExecutionContext]) -> list[Reference]:
        """Return the references of the objects that peers can call."""
        return [reference for thing in things if (reference := self.of(thing)) is not None]

    def find(self, reference: Reference) -> RtComponent | ExecutionContext | None:
        """Return the object of a reference, or None if the object is not local."""
        key = self.orb.key(reference)
        entry = self._by_key.get(key) if key else None
        return None if entry is None else entry.thing

    def code(self, code: ReturnCode) -> Any:
        """Convert a return code to the type that the stubs use."""
        return self.stubs.rtc.ReturnCode_t._item(int(code))


# Execution contexts of a component, by handle; those of peers may call its callbacks.

_PARTICIPATING: Final = 1_000
"""Handle of the first execution context that is not the component's own (OpenRTM-aist)."""

_FOREIGN: Final = 2_000
_NONE: Final = -1

_Callback = Callable[[ExecutionContext], ReturnCode]


def _calling(name: str) -> Callable[[AttachedContexts, int], Any]:
    """Return the operation that calls a callback of the component."""

    def call(contexts: AttachedContexts, exec_handle: int) -> Any:
        return contexts.call(exec_handle, name)

    return call


class AttachedContexts:
    """CORBA operations of a component on its execution contexts, local and foreign ones.

    Another process attaches its own execution context to the component, and gets a handle. It then
    calls `on_activated`, `on_execute` and so on with that handle. The argument of the component's
    callback is then an object that represents the foreign context. The time in this object is the
    time of the manager. The rate and the states of a foreign context are managed by the other
    process. If the other process calls with the handle of a local context, the result is
    PRECONDITION_NOT_MET.

    Args:
        component: component that owns the contexts.
        manager: manager that provides the time.
        references: references of the local execution contexts.
    """

    def __init__(
        self, component: RtComponent, manager: Manager, references: ServantReferences
    ) -> None:
        self._component, self._manager, self._references = component, manager, references
        self._calls = references.calls
        self._foreign: dict[int, tuple[Reference, ExecutionContext]] = {}
        self._next = _FOREIGN

    def get_owned_contexts(self) -> list[Reference]:
        """Return the execution contexts that end with the component."""
        return self._calls.call(lambda: self._references.all_of(self._component.own_contexts))

    def get_participating_contexts(self) -> list[Reference]:
        """Return all other execution contexts in which the component takes part."""
        peers = (reference for reference, _ in self._foreign.values())
        return self._calls.call(lambda: [*self._references.all_of(self._others()), *peers])

    def get_context(self, exec_handle: int) -> Reference:
        """Return the context that has a handle, or nil if there is none."""
        return self._calls.call(lambda: self._by_handle().get(exec_handle))

    def get_context_handle(self, cxt: Reference) -> int:
        """Return the handle (number) by which CORBA calls identify an execution context.

        The result is -1 if the component does not take part in the context.
        """
        return self._calls.call(lambda: self._handle(cxt))

    def is_alive(self, exec_context: Reference) -> bool:
        """Return whether the component is alive and takes part in the context."""
        return self._calls.call(
            lambda: self._component.alive and self._handle(exec_context) != _NONE
        )

    def attach_context(self, exec_context: Reference) -> int:
        """Add the component to the execution context of another process.

        Return the handle of the context.

        The result is -1 for a nil reference.
        """
        return self._calls.call(lambda: self._attach(exec_context))

    def detach_context(self, exec_handle: int) -> Any:
        """Stop taking part in a context of a peer."""
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

    def _by_handle(self) -> dict[int, Reference]:
        own, others = self._component.own_contexts, self._others()
        here = dict(enumerate(own)) | dict(enumerate(others, _PARTICIPATING))
        found = {handle: self._references.of(context) for handle, context in here.items()}
        return found | {handle: entry[0] for handle, entry in self._foreign.items()}

    def _handle(self, wanted: Reference) -> int:
        if wanted is None:
            return _NONE
        for handle, reference in self._by_handle().items():
            if reference is not None and reference._is_equivalent(wanted):
                return handle
        return _NONE

    def _attach(self, reference: Reference) -> int:
        if reference is None or (known := self._handle(reference)) != _NONE:
            return _NONE if reference is None else known
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
        callback: _Callback = getattr(self._component, name)
        return guarded(self._component.instance_name, callback, context)


# Moves between states for callers that wait, as those of OpenRTM do.

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
    """Request a state change of a component and wait for its end.

    Do not call this function in the manager's thread.

    Args:
        calls: queue that runs calls in the manager's thread.
        context: execution context of the component.
        component: component that takes part in the context.
        request: method that requests the change: `ExecutionContext.activate_component`,
            `deactivate_component` or `reset_component`.
        timeout_us: time to wait, first for the manager's thread, then for the end.

    Returns:
        The result of the request if it is refused. Otherwise, RTC_OK if the component is in the
        requested state, or RTC_ERROR if the callback failed, the component went to another state,
        or did not reach the requested state in time.

    Raises:
        TimeoutError: the manager's thread had no time. The change was then not requested.
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


INTERFACE = "RTC.ExecutionContextService"


class ExecutionContextServant:
    """CORBA object by which other processes control an execution context and its components.

    Its methods are the operations of the IDL. The operations that activate, deactivate or reset a
    component wait up to 1 s for the new state, as in OpenRTM. Components of other processes cannot
    join the context. Such requests return UNSUPPORTED.

    Args:
        context: execution context to serve.
        owner: component that owns the context, or None. When the owner ends, the context ends too.
        references: references of the components.
    """

    def __init__(
        self, context: ExecutionContext, owner: RtComponent | None, references: ServantReferences
    ) -> None:
        self._context, self._owner, self._references = context, owner, references
        self._calls, self._rtc = references.calls, references.stubs.rtc

    def get_profile(self) -> Any:
        """Return kind, rate, owner and participants."""
        return self._calls.call(self._profile)

    def is_running(self) -> bool:
        """Return whether the context runs."""
        return self._calls.call(lambda: self._context.running)

    def start(self) -> Any:
        """Start the context."""
        return self._code(self._context.start)

    def stop(self) -> Any:
        """Stop the context."""
        return self._code(self._context.stop)

    def get_rate(self) -> float:
        """Return the rate of the context in Hz."""
        return self._calls.call(lambda: self._context.rate_hz)

    def set_rate(self, rate: float) -> Any:
        """Change the rate of the context in Hz."""
        return self._code(lambda: self._context.set_rate(rate))

    def get_kind(self) -> Any:
        """Return PERIODIC."""
        return self._rtc.PERIODIC

    def add_component(self, comp: Reference) -> Any:
        """Add a component to the context."""
        return self._of_component(comp, self._context.add_component)

    def remove_component(self, comp: Reference) -> Any:
        """Remove a component from the context."""
        return self._of_component(comp, self._context.remove_component)

    def activate_component(self, comp: Reference) -> Any:
        """Move a component from Inactive to Active."""
        return self._move(comp, ExecutionContext.activate_component)

    def deactivate_component(self, comp: Reference) -> Any:
        """Move a component from Active to Inactive."""
        return self._move(comp, ExecutionContext.deactivate_component)

    def reset_component(self, comp: Reference) -> Any:
        """Move a component from Error to Inactive."""
        return self._move(comp, ExecutionContext.reset_component)

    def get_component_state(self, comp: Reference) -> Any:
        """Return the state of a component, or Created if it does not take part."""
        component = self._references.find(comp)
        if not isinstance(component, RtComponent):
            return self._rtc.CREATED_STATE
        state = self._calls.call(lambda: self._context.state_of(component))
        return self._rtc.LifeCycleState._item(int(state))

    def _profile(self) -> Any:
        context, references = self._context, self._references
        return self._rtc.ExecutionContextProfile(
            kind=self._rtc.PERIODIC,
            rate=context.rate_hz,
            owner=references.of(self._owner),
            participants=references.all_of(context.components),
            properties=[],
        )

    def _code(self, call: Callable[[], ReturnCode]) -> Any:
        return self._references.code(self._calls.call(call))

    def _of_component(self, comp: Reference, action: Callable[[RtComponent], ReturnCode]) -> Any:
        component = self._references.find(comp)
        if isinstance(component, RtComponent) and not self._references.fixed:
            return self._code(lambda: action(component))
        nil = comp is None
        return self._references.code(ReturnCode.BAD_PARAMETER if nil else ReturnCode.UNSUPPORTED)

    def _move(self, comp: Reference, request: Request) -> Any:
        component = self._references.find(comp)
        if not isinstance(component, RtComponent):
            return self._references.code(ReturnCode.BAD_PARAMETER)
        return self._references.code(move(self._calls, self._context, component, request))
