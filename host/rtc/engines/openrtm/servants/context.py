"""An execution context as peers see it (OMG RTC 1.0, ExecutionContextService)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.engines.openrtm.orb import Reference
from tickrig.host.rtc.engines.openrtm.servants.references import References
from tickrig.host.rtc.execution.execution_context import ExecutionContext
from tickrig.host.rtc.remote.move import Request, move
from tickrig.host.rtc.states import ReturnCode

INTERFACE = "RTC.ExecutionContextService"


class ExecutionContextServant:
    """Answers for an execution context; its methods are the operations of the IDL.

    Activating, deactivating and resetting wait until it is so, up to 1 s, as OpenRTM does.
    Components of other processes cannot take part: UNSUPPORTED.

    Args:
        context: the execution context.
        owner: the component with which it ends, if there is one.
        references: of the components.
    """

    def __init__(
        self, context: ExecutionContext, owner: RtComponent | None, references: References
    ) -> None:
        self._context, self._owner, self._references = context, owner, references
        self._calls, self._rtc = references.calls, references.stubs.rtc

    def get_profile(self) -> Any:
        """Return kind, rate, owner and participants."""
        return self._calls.call(self._profile)

    def is_running(self) -> bool:
        """Return whether it runs."""
        return self._calls.call(lambda: self._context.running)

    def start(self) -> Any:
        """Start it."""
        return self._code(self._context.start)

    def stop(self) -> Any:
        """Stop it."""
        return self._code(self._context.stop)

    def get_rate(self) -> float:
        """Return its rate in Hz."""
        return self._calls.call(lambda: self._context.rate_hz)

    def set_rate(self, rate: float) -> Any:
        """Change its rate, in Hz."""
        return self._code(lambda: self._context.set_rate(rate))

    def get_kind(self) -> Any:
        """Return PERIODIC."""
        return self._rtc.PERIODIC

    def add_component(self, comp: Reference) -> Any:
        """Let a component take part."""
        return self._of_component(comp, self._context.add_component)

    def remove_component(self, comp: Reference) -> Any:
        """Let a component take part no more."""
        return self._of_component(comp, self._context.remove_component)

    def activate_component(self, comp: Reference) -> Any:
        """Bring a component from Inactive to Active."""
        return self._move(comp, ExecutionContext.activate_component)

    def deactivate_component(self, comp: Reference) -> Any:
        """Bring a component from Active to Inactive."""
        return self._move(comp, ExecutionContext.deactivate_component)

    def reset_component(self, comp: Reference) -> Any:
        """Bring a component from Error to Inactive."""
        return self._move(comp, ExecutionContext.reset_component)

    def get_component_state(self, comp: Reference) -> Any:
        """Return the state of a component; Created if it takes no part."""
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
