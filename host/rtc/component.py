"""RT components and the execution contexts that run them (OMG RTC 1.0)."""

# Theory of operation
#
# A component (`RtComponent`) is alive between `initialize` and `finalize`. An alive component takes
# part in execution contexts, and in each context it is Inactive, Active or in Error. A context has
# a rate. Its periods begin at the multiples of `period_us`, in the time that the caller passes to
# `tick(now_us)`. A context reads no clock and does not wait.
#
# A request for a move (`activate_component`, `reset_component`, ...) returns at once whether the
# move is allowed in the present state. The context makes the move at the beginning of the next
# period. So a component changes its state between two calls of its `on_execute`, never during one.
# Components cannot see the order in which requests came.
#
# A period has three passes over all components, in the order in which they were added:
#
#   pre   changed configuration sets take effect, then the requested moves are made
#   do    on_execute in Active, on_error in Error
#   post  on_state_update in Active, of those that override it
#
# The `do` pass of all components ends before the `post` pass begins. So a value that a component
# writes in `do` is on the ports of the others when their `post` runs. RefHardRh3 depends on this
# order: it sends the speeds of this period in `post`, and takes the answer in the next `do`.
#
# Moves and their callbacks, in order:
#
#   from      to        callbacks
#   Inactive  Active    on_activated
#   Active    Inactive  on_deactivated; if it fails, on_aborting, and the state is Error
#   Active    Error     on_deactivated, on_aborting
#   Inactive  Error     on_aborting
#   Error     Inactive  on_reset; if it fails, the state stays Error
#
# A callback that raises, or returns another code than RTC_OK, brings its component to Error in the
# next pre-pass. Until then `wanted` is Error, and a later request does not replace it. Exceptions
# of a component are caught, so that they do not end the other components.
#
# A schedule ticks an `ExecutionContexts`. This object keeps the earliest `due_us` of its contexts,
# so a tick before that time costs one comparison. A context whose due time changes (start, stop,
# another rate) calls `replan`. Contexts that were not due do not store the time of a tick: their
# `now_us` is then the common `quiet_us`.

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import ClassVar, Final, ParamSpec, TypeVar

from tickrig.host.rtc.configuration import Configuration
from tickrig.host.rtc.listeners import call_listeners
from tickrig.host.rtc.ports.port import AnyPort, PortProfile
from tickrig.host.rtc.states import (
    MAX_RATE_HZ,
    MIN_RATE_HZ,
    ExecutionKind,
    LifeCycleState,
    ReturnCode,
    RtcRefused,
)
from tickrig.host.text.log import log_of
from tickrig.wire.instant import NEVER

_OK: Final = ReturnCode.RTC_OK
_CREATED: Final = LifeCycleState.CREATED
_INACTIVE: Final = LifeCycleState.INACTIVE
_ACTIVE: Final = LifeCycleState.ACTIVE
_ERROR: Final = LifeCycleState.ERROR

_SECOND_US: Final = 1_000_000

_LOG: Final = log_of(__name__)

A = ParamSpec("A")
P = TypeVar("P", bound=AnyPort)


def guarded(
    who: str, callback: Callable[A, ReturnCode], *args: A.args, **kwargs: A.kwargs
) -> ReturnCode:
    """Run a callback of a component, and return its code.

    An exception is logged and counts as RTC_ERROR, so that a faulty component cannot end the
    others.

    Args:
        who: name of the component, for the log.
        callback: callback to run.
        args: positional arguments of the callback.
        kwargs: keyword arguments of the callback.
    """
    try:
        return callback(*args, **kwargs)
    except Exception:
        return failed(who, callback)


def failed(who: str, callback: Callable[..., ReturnCode]) -> ReturnCode:
    """Log the exception that a callback has raised, and return RTC_ERROR."""
    _LOG.exception("%s: %s raised", who, callback.__name__)
    return ReturnCode.RTC_ERROR


class ComponentAction:
    """Base class with the callbacks of a component, which do nothing until they are overridden.

    A callback returns RTC_OK or an error code. After an error code, the component moves to the
    Error state, unless the docstring of the callback states otherwise. An exception is logged and
    counts as RTC_ERROR. A callback must not wait, because it would delay all components. The
    argument `ec` is the execution context that runs the callback, and `ec.now_us` is the present
    time.
    """

    def on_initialize(self) -> ReturnCode:
        """Initialize the component.

        The component stays Created unless this callback returns RTC_OK.
        """
        return _OK

    def on_finalize(self) -> ReturnCode:
        """Finalize the component. The return value is ignored."""
        return _OK

    def on_startup(self, ec: ExecutionContext) -> ReturnCode:
        """React to the start of the execution context `ec`."""
        return _OK

    def on_shutdown(self, ec: ExecutionContext) -> ReturnCode:
        """React to the stop of the execution context `ec`."""
        return _OK

    def on_rate_changed(self, ec: ExecutionContext) -> ReturnCode:
        """React to a new rate of the execution context `ec`."""
        return _OK

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """React to the move to Active in `ec`."""
        return _OK

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """React to the move from Active to Inactive or to Error in `ec`."""
        return _OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Do the work of a period of `ec` while the component is Active."""
        return _OK

    def on_state_update(self, ec: ExecutionContext) -> ReturnCode:
        """Do further work of an Active period, after on_execute of all components in `ec`."""
        return _OK

    def on_aborting(self, ec: ExecutionContext) -> ReturnCode:
        """React to the move to Error in `ec`. The return value is ignored."""
        return _OK

    def on_error(self, ec: ExecutionContext) -> ReturnCode:
        """Do the work of a period of the execution context `ec`, in the state Error.

        The return value is ignored.
        """
        return _OK

    def on_reset(self, ec: ExecutionContext) -> ReturnCode:
        """Prepare the component to leave the Error state, because a reset was requested.

        If this callback returns RTC_OK, the component moves to Inactive in `ec`. Otherwise, it
        stays in Error.
        """
        return _OK


@dataclass(frozen=True, slots=True)
class ModuleSpec:
    """Description of a component type, such as `ConsoleIn` (OpenRTM-aist 1.x, module profile).

    Attributes:
        type_name: name of the component type, such as `ConsoleIn`.
        description: description of the type in one line.
        version: version of the type.
        vendor: vendor of the type.
        category: purpose of the type, such as `sensor`.
    """

    type_name: str
    description: str = ""
    version: str = "1.0.0"
    vendor: str = "tickrig"
    category: str = "generic"


@dataclass(frozen=True, slots=True, kw_only=True)
class ComponentProfile(ModuleSpec):
    """Description of one component, as in OpenRTM: its type, name, ports and properties.

    Attributes:
        instance_name: name of the component.
        port_profiles: descriptions of its ports.
        properties: further properties of the component.
    """

    instance_name: str
    port_profiles: tuple[PortProfile, ...]
    properties: Mapping[str, str] = field(default_factory=dict)


class RtComponent(ComponentAction):
    """An RT component with life cycle, ports and configuration (OMG RTC 1.0, LightweightRTObject).

    A subclass has a `spec`, makes its ports and parameters in the constructor
    (`add_port`, `configuration.bind`), and overrides the callbacks that it needs
    (`on_activated`, `on_execute`, ...). A `Manager` creates components and runs them.

    Not emulated: composite components, and a state of its own in each execution context in
    addition to the state of the life cycle.

    Args:
        instance_name: name that is unique in a system, such as `ConsoleIn0`.

    Attributes:
        spec: properties that all components of the class share. Each subclass sets them.
        instance_name: name that is unique in a system, such as `ConsoleIn0`.
        alive: whether the component is alive, which is True between `initialize` and `finalize`.
        configuration: configuration sets of the component. One of the sets is active.
        ports: ports by name, in the order in which they were added.
        contexts: execution contexts in which the component takes part. The first context decides
            its state.
        own_contexts: execution contexts that end with the component.
    """

    spec: ClassVar[ModuleSpec]

    def __init__(self, instance_name: str) -> None:
        self.instance_name, self.alive = instance_name, False
        self.configuration = Configuration()
        self.ports: dict[str, AnyPort] = {}
        self.contexts: list[ExecutionContext] = []
        self.own_contexts: list[ExecutionContext] = []

    @property
    def profile(self) -> ComponentProfile:
        """Profile of the component in its present state."""
        ports = tuple(port.profile for port in self.ports.values())
        return ComponentProfile(
            **asdict(self.spec), instance_name=self.instance_name, port_profiles=ports
        )

    def add_port(self, port: P) -> P:
        """Add a port to the component. Subclasses call this method in their constructor.

        Args:
            port: data port or service port to add.

        Returns:
            The added port.

        Raises:
            RtcRefused: another port of the component has this name.
        """
        if port.name in self.ports:
            raise RtcRefused(f"{self.instance_name} has a port {port.name!r} already")
        port.owner = self.instance_name
        self.ports[port.name] = port
        return port

    def remove_port(self, port: AnyPort) -> None:
        """Disconnect a port and remove it from the component."""
        port.disconnect_all()
        del self.ports[port.name]
        port.owner = ""

    def own(self, context: ExecutionContext) -> ReturnCode:
        """Add the component to an execution context that is to end together with the component.

        Args:
            context: execution context that the component owns from now on.

        Returns:
            The result of `ExecutionContext.add_component`.
        """
        code = context.add_component(self)
        if code is ReturnCode.RTC_OK:
            self.own_contexts.append(context)
        return code

    def initialize(self) -> ReturnCode:
        """Call on_initialize, make the component alive, and start the contexts that it owns.

        Returns:
            PRECONDITION_NOT_MET if the component is already alive. Otherwise, the result of
            on_initialize. If that result is not RTC_OK, the component stays in the state Created.
        """
        if self.alive:
            return ReturnCode.PRECONDITION_NOT_MET
        code = guarded(self.instance_name, self._begin)
        if code is ReturnCode.RTC_OK:
            self.alive = True
            for context in self.own_contexts:
                context.start()
        return code

    def finalize(self) -> ReturnCode:
        """Call on_finalize and end the component, regardless of the result of on_finalize.

        Returns:
            PRECONDITION_NOT_MET if the component is not alive, or still takes part in an execution
            context. Otherwise, the result of on_finalize.
        """
        if not self.alive or self.contexts:
            return ReturnCode.PRECONDITION_NOT_MET
        self.alive = False
        return guarded(self.instance_name, self.on_finalize)

    def exit(self) -> ReturnCode:
        """End the component: disconnect its ports, leave its execution contexts, call on_finalize.

        If the component is Active, on_deactivated is called first. The execution contexts that the
        component owns are stopped, and other components are removed from them. Do not call this
        method from a callback.

        Returns:
            PRECONDITION_NOT_MET if the component is not alive. Otherwise, the result of
            on_finalize.
        """
        if not self.alive:
            return ReturnCode.PRECONDITION_NOT_MET
        for port in self.ports.values():
            port.disconnect_all()
        for context in self.own_contexts:
            context.close()
        for context in tuple(self.contexts):
            context.release_component(self)
        self.own_contexts.clear()
        return self.finalize()

    def _begin(self) -> ReturnCode:
        self.configuration.update()
        return self.on_initialize()


# One component in one execution context.

_Callback = Callable[["ExecutionContext"], ReturnCode]


class _Participant:
    """A component as its execution context sees it.

    Attributes:
        state: present state, or Created after the component was removed.
        wanted: state to which the next pre-pass moves the component, or None.
    """

    __slots__ = ("_context", "_updates", "component", "state", "wanted")

    def __init__(self, component: RtComponent, context: ExecutionContext) -> None:
        self.component, self._context = component, context
        self.state: LifeCycleState = _INACTIVE
        self.wanted: LifeCycleState | None = None
        base = ComponentAction.on_state_update
        self._updates = type(component).on_state_update is not base

    def request(self, source: LifeCycleState, wanted: LifeCycleState) -> ReturnCode:
        """Request that the component moves from one state to another in the next period.

        Return PRECONDITION_NOT_MET if the component is not in the state `source`, or if its move to
        Error is already planned.
        """
        if self.state is not source or self.wanted is _ERROR:
            return ReturnCode.PRECONDITION_NOT_MET
        self.wanted = wanted
        return _OK

    def abort(self) -> None:
        """Request the move of the component to Error, unless it is already in Error."""
        if self.state is not _ERROR:
            self.wanted = _ERROR

    def notify(self, callback: _Callback) -> ReturnCode:
        """Run a callback of the component, and return the return code of the callback.

        If the callback fails, the component moves to Error at the beginning of the next period.
        """
        code = self._call(callback)
        if code is not _OK:
            self.abort()
        return code

    def pre(self) -> None:
        """Make the requested move, in the first pass of a period."""
        if self.component.configuration.changed:
            self.notify(self._update_configuration)
        if (wanted := self.wanted) is not None:
            self.wanted = None
            code = _MOVES[self.state, wanted](self)
            if self._context.on_move:
                self._report(code)

    def do(self) -> None:
        """Do the work of the state, in the second pass of a period."""
        if self.state is _ACTIVE:
            if self.wanted is not _ERROR and self._call(self.component.on_execute) is not _OK:
                self.wanted = _ERROR
        elif self.state is _ERROR:
            self._call(self.component.on_error)

    def post(self) -> None:
        """Do the third pass of a period, after the second pass of all participants."""
        if self._updates and self.state is _ACTIVE and self.wanted is not _ERROR:
            self.notify(self.component.on_state_update)

    def leave(self) -> None:
        """Leave the context at once, because the component ends. The state is then Created."""
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

    def _call(self, callback: _Callback) -> ReturnCode:
        try:  # `guarded`, without a call for each callback
            return callback(self._context)
        except Exception:
            return failed(self.component.instance_name, callback)


_MOVES: Final[dict[tuple[LifeCycleState, LifeCycleState], Callable[[_Participant], ReturnCode]]] = {
    (_INACTIVE, _ACTIVE): _Participant._activate,
    (_INACTIVE, _ERROR): _Participant._enter_error,
    (_ACTIVE, _INACTIVE): _Participant._deactivate,
    (_ACTIVE, _ERROR): _Participant._abort_active,
    (_ERROR, _INACTIVE): _Participant._reset,
}


# The execution contexts of a schedule: which is due next, and what time it is for all.


class ExecutionContexts:
    """Group of execution contexts that a schedule ticks one after the other.

    The contexts run in the order in which they were added. The group stores the earliest due time
    of its contexts. If a tick comes before that time, the contexts are not checked, which saves
    time.

    Attributes:
        quiet_us: time in us of the latest tick in which no context was due. In such a tick the
            group does not call its contexts, so the contexts cannot store the time. The `now_us` of
            a context reads the time from here.
    """

    __slots__ = ("_contexts", "_due_us", "_known", "quiet_us")

    def __init__(self) -> None:
        self._contexts: list[ExecutionContext] = []
        self._due_us, self._known, self.quiet_us = NEVER, True, 0

    @property
    def due_us(self) -> int:
        """Start of the next period of a context, or `NEVER` while no context runs."""
        if not self._known:
            self._known = True
            self._due_us = min((context.due_us for context in self._contexts), default=NEVER)
        return self._due_us

    def tick(self, now_us: int) -> None:
        """Advance the time, and run one period of each execution context that is due.

        Args:
            now_us: current time in us, which is never less than before.
        """
        if now_us < self.due_us:
            self.quiet_us = now_us
            return
        for context in self._contexts:
            context.tick(now_us)

    def replan(self) -> None:
        """Record that the earliest due time must be computed again."""
        self._known = False

    def add(self, context: ExecutionContext, now_us: int) -> None:
        """Tick an execution context from now on. Adding a context twice has no effect."""
        if context not in self._contexts:
            context.tick(now_us)
            self._contexts.append(context)
            context.join(self)
            self.replan()

    def remove(self, context: ExecutionContext) -> None:
        """Stop ticking an execution context."""
        self._contexts.remove(context)
        context.join(ExecutionContexts())
        self.replan()


MoveListener = Callable[["RtComponent", LifeCycleState, ReturnCode], object]


class ExecutionContext:
    """An execution context, which runs components period by period.

    Each period has three passes over all components, in the order of adding:

    - pre: requested moves (activate, deactivate, reset, abort);
    - do: on_execute in Active, on_error in Error;
    - post: on_state_update in Active.

    Requests are checked when they are made, and take effect in the next period. The requests do not
    wait. Periods begin at the multiples of `period_us`. The kind of the context is PERIODIC.
    EVENT_DRIVEN and OTHER are not emulated.

    Args:
        rate_hz: number of periods per second, 1 uHz to 1 MHz. A period is a whole number of
            microseconds.

    Attributes:
        due_us: start of the next period, or `NEVER` while the context is stopped.
        rate_hz: number of periods per second.
        period_us: length of a period.
        running: whether the context runs, which is True between start and stop.
        allows_period: function that is called with each new period in us, if not all periods are
            possible. The function returns whether the period is possible.
        on_move: function that is called after each move with the component, its state and the
            result of the callback of the move. The function is also called if on_reset failed and
            the component stayed in Error. The state is Created if the component left the context.

    Raises:
        ValueError: the rate is out of range.
    """

    kind: Final = ExecutionKind.PERIODIC

    def __init__(self, rate_hz: float = 1_000.0) -> None:
        if not _possible(rate_hz):
            raise ValueError(f"rate {rate_hz} Hz is not in {MIN_RATE_HZ}..{MAX_RATE_HZ} Hz")
        self._ticked_us, self.due_us, self.running = 0, NEVER, False
        self._others = ExecutionContexts()
        self.rate_hz, self.period_us = rate_hz, _period_us(rate_hz)
        self._participants: tuple[_Participant, ...] = ()
        self._by_id: dict[int, _Participant] = {}
        self.allows_period: Callable[[int], bool] | None = None
        self.on_move: list[MoveListener] = []

    @property
    def now_us(self) -> int:
        """The time of the latest tick, which is the present time for callbacks."""
        ticked_us, quiet_us = self._ticked_us, self._others.quiet_us
        return ticked_us if ticked_us > quiet_us else quiet_us  # noqa: FURB136 - twice as fast

    @property
    def components(self) -> tuple[RtComponent, ...]:
        """The participants, in the order in which they run."""
        return tuple(participant.component for participant in self._participants)

    def tick(self, now_us: int) -> None:
        """Advance the time of the context, and run one period of its components if a period is due.

        Args:
            now_us: current time in us.
        """
        self._ticked_us = now_us
        if now_us < self.due_us:
            return
        self._plan()
        participants = self._participants
        for step in _PASSES:
            for participant in participants:
                if self.running:
                    step(participant)

    def start(self) -> ReturnCode:
        """Start the execution context, and call on_startup of each of its components.

        Returns:
            PRECONDITION_NOT_MET if the context already runs or one of its components is not alive.
            Otherwise, RTC_OK.
        """
        if self.running or not all(component.alive for component in self.components):
            return ReturnCode.PRECONDITION_NOT_MET
        self.running = True
        self._plan()
        self._notify(lambda component: component.on_startup)
        return ReturnCode.RTC_OK

    def stop(self) -> ReturnCode:
        """Stop the execution context, and call on_shutdown of each of its components.

        The states of the components do not change.

        Returns:
            PRECONDITION_NOT_MET if the context does not run. Otherwise, RTC_OK.
        """
        if not self.running:
            return ReturnCode.PRECONDITION_NOT_MET
        self.running, self.due_us = False, NEVER
        self._others.replan()
        self._notify(lambda component: component.on_shutdown)
        return ReturnCode.RTC_OK

    def join(self, others: ExecutionContexts) -> None:
        """Store the group to which this execution context belongs.

        The methods `ExecutionContexts.add` and `ExecutionContexts.remove` call this method.

        Args:
            others: the group. When the due time of this context changes, this context notifies the
                group.
        """
        self._ticked_us, self._others = self.now_us, others

    def close(self) -> None:
        """Deactivate all components at once, stop the context, and remove the components."""
        for participant in self._participants:
            participant.leave()
        self.stop()
        for participant in self._participants:
            self._release(participant)

    def set_rate(self, rate_hz: float) -> ReturnCode:
        """Change the rate of the execution context, and call on_rate_changed of its components.

        Args:
            rate_hz: number of periods per second, 1 uHz to 1 MHz.

        Returns:
            BAD_PARAMETER if the rate is out of range or `allows_period` rejects its period.
            Otherwise, RTC_OK.
        """
        if not _possible(rate_hz):
            return ReturnCode.BAD_PARAMETER
        if self.allows_period is not None and not self.allows_period(_period_us(rate_hz)):
            return ReturnCode.BAD_PARAMETER
        self.rate_hz, self.period_us = rate_hz, _period_us(rate_hz)
        if self.running:
            self._plan()
        self._notify(lambda component: component.on_rate_changed)
        return ReturnCode.RTC_OK

    def add_component(self, component: RtComponent) -> ReturnCode:
        """Add a component to the end of the execution context's order, in the state Inactive.

        Args:
            component: component to add.

        Returns:
            PRECONDITION_NOT_MET if the context already has this component. Otherwise, RTC_OK.
        """
        if self._find(component) is not None:
            return ReturnCode.PRECONDITION_NOT_MET
        participant = self._by_id[id(component)] = _Participant(component, self)
        self._participants += (participant,)
        component.contexts.append(self)
        return ReturnCode.RTC_OK

    def remove_component(self, component: RtComponent) -> ReturnCode:
        """Remove a component that is not Active from the execution context.

        Args:
            component: component to remove.

        Returns:
            BAD_PARAMETER if the context does not have this component, or PRECONDITION_NOT_MET if
            the component is Active. Otherwise, RTC_OK.
        """
        participant = self._find(component)
        if participant is not None and participant.state is LifeCycleState.ACTIVE:
            return ReturnCode.PRECONDITION_NOT_MET
        return self.release_component(component)

    def release_component(self, component: RtComponent) -> ReturnCode:
        """Remove a component from the execution context, even if the component is Active.

        If the component is Active, its on_deactivated is called at once.

        Args:
            component: component to remove.

        Returns:
            BAD_PARAMETER if the context does not have this component. Otherwise, RTC_OK.
        """
        participant = self._find(component)
        if participant is None:
            return ReturnCode.BAD_PARAMETER
        self._release(participant)
        return ReturnCode.RTC_OK

    def activate_component(self, component: RtComponent) -> ReturnCode:
        """Request that a component moves from Inactive to Active in the next period.

        Args:
            component: component to activate.

        Returns:
            BAD_PARAMETER if the component is not alive or not in this context, or
            PRECONDITION_NOT_MET if it is not Inactive. Otherwise, RTC_OK.
        """
        return self._request(component, LifeCycleState.INACTIVE, LifeCycleState.ACTIVE)

    def deactivate_component(self, component: RtComponent) -> ReturnCode:
        """Request that a component moves from Active to Inactive in the next period.

        Args:
            component: component to deactivate.

        Returns:
            BAD_PARAMETER if the component is not alive or not in this context, or
            PRECONDITION_NOT_MET if it is not Active or its move to Error is already planned.
            Otherwise, RTC_OK.
        """
        return self._request(component, LifeCycleState.ACTIVE, LifeCycleState.INACTIVE)

    def reset_component(self, component: RtComponent) -> ReturnCode:
        """Request that a component moves from Error to Inactive in the next period.

        Args:
            component: component to reset.

        Returns:
            BAD_PARAMETER if the component is not alive or not in this context, or
            PRECONDITION_NOT_MET if it is not in Error. Otherwise, RTC_OK.
        """
        return self._request(component, LifeCycleState.ERROR, LifeCycleState.INACTIVE)

    def abort_component(self, component: RtComponent) -> ReturnCode:
        """Request that a component moves from Inactive or Active to Error in the next period.

        A component that represents a device uses this when the device fails. OMG RTC has no such
        request. In OMG RTC, a component moves to Error only if a callback fails.

        Args:
            component: component to abort.

        Returns:
            BAD_PARAMETER if the component is not alive or not in this context, or
            PRECONDITION_NOT_MET if it is already in Error. Otherwise, RTC_OK.
        """
        participant = self._find(component)
        if participant is None or not component.alive:
            return ReturnCode.BAD_PARAMETER
        if participant.state is LifeCycleState.ERROR:
            return ReturnCode.PRECONDITION_NOT_MET
        participant.abort()
        return ReturnCode.RTC_OK

    def state_of(self, component: RtComponent) -> LifeCycleState:
        """Return the life-cycle state of a component in this execution context.

        The state is Created if the component is not alive or not in this context.
        """
        participant = self._find(component)
        if participant is None or not component.alive:
            return LifeCycleState.CREATED
        return participant.state

    def _request(
        self, component: RtComponent, source: LifeCycleState, wanted: LifeCycleState
    ) -> ReturnCode:
        participant = self._find(component)
        if participant is None or not component.alive:
            return ReturnCode.BAD_PARAMETER
        return participant.request(source, wanted)

    def _release(self, participant: _Participant) -> None:
        participant.leave()
        self._participants = tuple(p for p in self._participants if p is not participant)
        del self._by_id[id(participant.component)]
        participant.component.contexts.remove(self)

    def _find(self, component: RtComponent) -> _Participant | None:
        return self._by_id.get(id(component))

    def _plan(self) -> None:
        """Plan the next period."""
        now_us = self.now_us
        self.due_us = now_us - now_us % self.period_us + self.period_us
        self._others.replan()

    def _notify(self, callback: Callable[[RtComponent], _Callback]) -> None:
        for participant in self._participants:
            participant.notify(callback(participant.component))


_PASSES: Final = (_Participant.pre, _Participant.do, _Participant.post)


def _possible(rate_hz: float) -> bool:
    return MIN_RATE_HZ <= rate_hz <= MAX_RATE_HZ


def _period_us(rate_hz: float) -> int:
    return round(_SECOND_US / rate_hz)
