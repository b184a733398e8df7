"""What peers call: components, their contexts and configurations, and the manager (OMG RTC 1.0)."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Protocol, TypeVar

from omniORB import any as omni_any

from tickrig.host.rtc.component import ExecutionContext, ModuleSpec, RtComponent, guarded
from tickrig.host.rtc.configuration import Configuration, as_text
from tickrig.host.rtc.engines.openrtm.orb import Orb, Reference, nvlist
from tickrig.host.rtc.engines.openrtm.stubs import Stubs
from tickrig.host.rtc.states import LifeCycleState, ReturnCode, RtcRefused
from tickrig.host.rtc.system.call_queue import CALL_TIMEOUT_US, CallQueue
from tickrig.host.rtc.system.manager import DEFAULT_RATE_HZ, Manager
from tickrig.host.text.log import log_of

# Which reference stands for which component and execution context.


@dataclass(slots=True)
class _Entry:
    thing: RtComponent | ExecutionContext
    reference: Reference


class ServantReferences:
    """The components and execution contexts that peers can call, by reference and back.

    What is entered and removed is so in the manager's thread; any thread looks things up.

    Args:
        orb: serves them.
        stubs: of our IDL.
        calls: those of the manager's thread.
        fixed: components come and go as their process decides: peers neither create nor end
            any, nor move one to another execution context.
    """

    def __init__(self, orb: Orb, stubs: Stubs, calls: CallQueue, *, fixed: bool = False) -> None:
        self.orb, self.stubs, self.calls, self.fixed = orb, stubs, calls, fixed
        self._by_id: dict[int, _Entry] = {}
        self._by_key: dict[bytes, _Entry] = {}

    def enter(
        self, thing: RtComponent | ExecutionContext, interface: str, *answers: object
    ) -> Reference:
        """Let peers call a component or execution context; see `Orb.serve`."""
        reference = self.orb.serve(self.stubs.skeleton(interface), *answers)
        entry = _Entry(thing, reference)
        self._by_id[id(thing)] = self._by_key[self.orb.key(reference)] = entry
        return reference

    def remove(self, thing: RtComponent | ExecutionContext) -> None:
        """Let nobody call it any more."""
        if (entry := self._by_id.pop(id(thing), None)) is not None:
            del self._by_key[self.orb.key(entry.reference)]
            self.orb.withdraw(entry.reference)

    def of(self, thing: RtComponent | ExecutionContext | None) -> Reference:
        """Return its reference; nil (None) if peers cannot call it."""
        entry = self._by_id.get(id(thing))
        return None if entry is None else entry.reference

    def all_of(self, things: Iterable[RtComponent | ExecutionContext]) -> list[Reference]:
        """Return the references of those that peers can call."""
        return [reference for thing in things if (reference := self.of(thing)) is not None]

    def find(self, reference: Reference) -> RtComponent | ExecutionContext | None:
        """Return what a reference stands for; None if that is not here."""
        key = self.orb.key(reference)
        entry = self._by_key.get(key) if key else None
        return None if entry is None else entry.thing

    def code(self, code: ReturnCode) -> Any:
        """Return a code as the stubs have it."""
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

    def __init__(
        self, component: RtComponent, manager: Manager, references: ServantReferences
    ) -> None:
        self._component, self._manager, self._references = component, manager, references
        self._calls = references.calls
        self._foreign: dict[int, tuple[Reference, ExecutionContext]] = {}
        self._next = _FOREIGN

    def get_owned_contexts(self) -> list[Reference]:
        """Return those that end with the component."""
        return self._calls.call(lambda: self._references.all_of(self._component.own_contexts))

    def get_participating_contexts(self) -> list[Reference]:
        """Return all others that it takes part in."""
        peers = (reference for reference, _ in self._foreign.values())
        return self._calls.call(lambda: [*self._references.all_of(self._others()), *peers])

    def get_context(self, exec_handle: int) -> Reference:
        """Return the context of a handle; nil if there is none."""
        return self._calls.call(lambda: self._by_handle().get(exec_handle))

    def get_context_handle(self, cxt: Reference) -> int:
        """Return the handle of a context; -1 if the component takes no part in it."""
        return self._calls.call(lambda: self._handle(cxt))

    def is_alive(self, exec_context: Reference) -> bool:
        """Return whether the component lives, and takes part in that context."""
        return self._calls.call(
            lambda: self._component.alive and self._handle(exec_context) != _NONE
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


CONTEXT_IDL: Final = "RTC.ExecutionContextService"


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
        self, context: ExecutionContext, owner: RtComponent | None, references: ServantReferences
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


# The configuration of a component as peers see it (OMG SDO 1.0, Configuration).

R = TypeVar("R")

CONFIGURATION_IDL: Final = "SDOPackage.Configuration"

_WIDGETS: Final = "__widget__"
_CONSTRAINTS: Final = "__constraints__"
"""Sets that say how an editor shows the parameters, and what they may be (OpenRTM-aist)."""


class ConfigurationServant:
    """Answers for a configuration; its methods are the operations of the IDL.

    A change is checked as a whole and takes effect in the next period. Two more sets,
    `__widget__` and `__constraints__`, tell editors of the parameters; they cannot be changed.

    Not emulated: parameters outside of sets, services and organizations that peers add.

    Args:
        configuration: the configuration.
        calls: those of the manager's thread.
        stubs: of our IDL.
    """

    def __init__(self, configuration: Configuration, calls: CallQueue, stubs: Stubs) -> None:
        self._configuration, self._calls, self._sdo = configuration, calls, stubs.sdo

    def get_configuration_sets(self) -> list[Any]:
        """Return all sets."""
        return self._calls.call(lambda: [self._set(*item) for item in self._sets().items()])

    def get_configuration_set(self, config_id: str) -> Any:
        """Return a set; NotAvailable without it."""
        return self._calls.call(lambda: self._found(config_id))

    def get_active_configuration_set(self) -> Any:
        """Return the set whose values hold."""
        return self._calls.call(lambda: self._found(self._configuration.active_id))

    def set_configuration_set_values(self, configuration_set: Any) -> bool:
        """Change values of a set that is there, all or none."""
        set_id, values = configuration_set.id, _values(configuration_set)
        return self._changed(lambda: self._change(set_id, values))

    def add_configuration_set(self, configuration_set: Any) -> bool:
        """Add a set; False if one has its ID."""
        set_id, values = configuration_set.id, _values(configuration_set)

        def add() -> bool:
            is_new = set_id not in self._sets()
            if is_new:
                self._configuration.add_set(set_id, values)
            return is_new

        return self._changed(add)

    def remove_configuration_set(self, config_id: str) -> bool:
        """Remove a set, but not the default one and that which is active."""
        return self._changed(lambda: self._configuration.remove_set(config_id))

    def activate_configuration_set(self, config_id: str) -> bool:
        """Let the values of a set hold."""
        return self._changed(lambda: self._configuration.activate(config_id))

    def get_configuration_parameters(self) -> list[Any]:
        """Return none: all parameters are in sets."""
        return []

    get_configuration_parameter_values = get_configuration_parameters

    def get_configuration_parameter_value(self, name: str, *_: object) -> Any:
        """Refuse: there is none."""
        raise self._sdo.InvalidParameter(f"no parameter {name!r} outside of sets")

    set_configuration_parameter = get_configuration_parameter_value

    def set_device_profile(self, profile: Any) -> bool:
        """Refuse, as all that follow."""
        return False

    add_service_profile = remove_service_profile = set_device_profile
    add_organization = remove_organization = set_device_profile

    def _sets(self) -> dict[str, Mapping[str, str]]:
        parameters = self._configuration.parameters.values()
        widgets = {one.name: one.widget for one in parameters if one.widget}
        constraints = {one.name: str(one.constraint) for one in parameters if str(one.constraint)}
        told = {_WIDGETS: widgets, _CONSTRAINTS: constraints}
        shown = {set_id: values for set_id, values in told.items() if values}
        return {**self._configuration.sets, **shown}

    def _set(self, set_id: str, values: Mapping[str, str]) -> Any:
        data = nvlist(values)
        return self._sdo.ConfigurationSet(id=set_id, description="", configuration_data=data)

    def _found(self, set_id: str) -> Any:
        if (values := self._sets().get(set_id)) is None:
            raise self._sdo.NotAvailable(f"no configuration set {set_id!r}")
        return self._set(set_id, values)

    def _change(self, set_id: str, values: dict[str, str]) -> None:
        if (before := self._sets().get(set_id)) is None:
            raise RtcRefused(f"no configuration set {set_id!r}")
        if set_id in (_WIDGETS, _CONSTRAINTS):
            if {**before, **values} != before:
                raise RtcRefused(f"{set_id} is not to be changed")
            return  # rtresurrect sets what was saved
        self._configuration.add_set(set_id, {**before, **values})

    def _changed(self, change: Callable[[], bool | None]) -> bool:
        """Make a change; InvalidParameter says why it cannot be."""
        try:
            return self._calls.call(change) is not False
        except RtcRefused as error:
            raise self._sdo.InvalidParameter(str(error)) from error


def _values(configuration_set: Any) -> dict[str, str]:
    """Return the values of a set as text, whatever type they came with."""
    values = {}
    for item in configuration_set.configuration_data:
        value = omni_any.from_any(item.value)
        values[item.name] = as_text(tuple(value) if isinstance(value, list) else value)
    return values


# A component as peers see it (OMG RTC 1.0, RTObject; SDO 1.0, SDO).

COMPONENT_IDL: Final = "OpenRTM.DataFlowComponent"


class _Ports(Protocol):
    """The ports of a component as an ORB serves them."""

    def services(self) -> list[Reference]:
        """Return a PortService for each."""
        ...

    def close(self) -> None:
        """Let nobody call them any more."""
        ...


class RtObjectServant:
    """Answers for a component; its methods are the operations of the IDL.

    Not emulated: organizations and composite components (lists of them are empty), and
    services that peers bring along.

    Args:
        component: the component.
        manager: has it.
        references: of components.

    Attributes:
        ports: its ports, once they are served.
        configuration: reference of its configuration.
    """

    def __init__(
        self, component: RtComponent, manager: Manager, references: ServantReferences
    ) -> None:
        self._component, self._manager, self._references = component, manager, references
        self._calls, self._stubs = references.calls, references.stubs
        self.ports: _Ports | None = None
        self.configuration: Reference = None

    def get_component_profile(self) -> Any:
        """Return what there is to know."""
        spec, name = self._component.spec, self._component.instance_name
        profiles = [port.get_port_profile() for port in self.get_ports()]
        return self._stubs.rtc.ComponentProfile(
            instance_name=name,
            type_name=spec.type_name,
            description=spec.description,
            version=spec.version,
            vendor=spec.vendor,
            category=spec.category,
            port_profiles=profiles,
            parent=None,
            properties=nvlist(_properties_of(self._component)),
        )

    def get_ports(self) -> list[Reference]:
        """Return its ports."""
        return [] if self.ports is None else self.ports.services()

    def initialize(self) -> Any:
        """Refuse: it was initialized when its manager got it."""
        return self._code(self._component.initialize)

    def finalize(self) -> Any:
        """Refuse: a component of a manager takes part in some context; `exit` ends it."""
        return self._code(self._component.finalize)

    def exit(self) -> Any:
        """End the component."""
        return self._code(self._exit)

    on_initialize, on_finalize = initialize, finalize

    def get_sdo_id(self) -> str:
        """Return its instance name."""
        return self._component.instance_name

    def get_sdo_type(self) -> str:
        """Return its description."""
        return self._component.spec.description

    def get_device_profile(self) -> Any:
        """Return who made what."""
        spec = self._component.spec
        return self._stubs.sdo.DeviceProfile(
            spec.category, spec.vendor, spec.type_name, spec.version, []
        )

    def get_configuration(self) -> Reference:
        """Return its configuration."""
        return self.configuration

    def get_organizations(self) -> list[Any]:
        """Return none, as those that follow."""
        return []

    get_owned_organizations = get_service_profiles = get_status_list = get_organizations

    def get_service_profile(self, name: str) -> Any:
        """Refuse, as those that follow: it has none."""
        raise self._stubs.sdo.InvalidParameter(f"it has no {name!r}")

    get_sdo_service = get_status = get_service_profile

    def get_monitoring(self) -> Any:
        """Refuse: there is none."""
        raise self._stubs.sdo.InterfaceNotImplemented("no Monitoring")

    def _exit(self) -> ReturnCode:
        if self._references.fixed:
            return ReturnCode.UNSUPPORTED
        self._manager.delete(self._component.instance_name)
        return ReturnCode.RTC_OK

    def _code(self, call: Any) -> Any:
        return self._references.code(self._calls.call(call))


def _properties_of(component: RtComponent) -> dict[str, str]:
    """Return what OpenRTM has in the properties of a component's profile."""
    spec = component.spec
    return {
        "implementation_id": spec.type_name,
        "type_name": spec.type_name,
        "instance_name": component.instance_name,
        "description": spec.description,
        "version": spec.version,
        "vendor": spec.vendor,
        "category": spec.category,
        "language": "Python",
        "lang_type": "SCRIPT",
        "naming.type": "corba",
        **component.profile.properties,
    }


# The manager of this process as rtmgr and RT System Editor see it (OpenRTM-aist, RTM).

MANAGER_IDL: Final = "RTM.Manager"
NAME: Final = "manager"
SPEC: Final = ModuleSpec(NAME, category=NAME)

_LOG: Final = log_of(__name__)
_UNSET: Final = (
    *("naming_formats", "refstring_path", "components.precreate", "modules.load_path"),
    *("modules.config_path", "modules.preload", "modules.init_func_prefix"),
    *("modules.init_func_suffix", "modules.download_allowed", "modules.abs_path_allowed"),
)
"""What rtcat misses of a profile where it is not there."""

_RATE: Final = "exec_cxt.periodic.rate"


class ManagerServant:
    """Answers for a manager; its methods are the operations of the IDL.

    It creates and deletes components of the types that its process knows, and ends the
    process. It loads no modules, knows no other managers and has no settings to change:
    UNSUPPORTED, and empty lists.

    Args:
        manager: the manager.
        references: of components.
        stop: ends the process in its own way.
    """

    def __init__(
        self, manager: Manager, references: ServantReferences, stop: Callable[[], object]
    ) -> None:
        self._manager, self._references, self._stop = manager, references, stop
        self._calls, self._rtm = references.calls, references.stubs.rtm

    def get_components(self) -> list[Reference]:
        """Return the components."""
        return self._calls.call(lambda: self._references.all_of(self._manager.components))

    def get_component_profiles(self) -> list[Any]:
        """Return what there is to know of them."""
        return [component.get_component_profile() for component in self.get_components()]

    def create_component(self, module_name: str) -> Reference:
        """Create a component of `TYPE?instance_name=NAME&...`; nil if that cannot be."""
        type_name, _, rest = module_name.partition("?" if "?" in module_name else "&")
        options = dict(_option(word) for word in rest.split("&") if word)
        return self._calls.call(lambda: self._create(type_name, options))

    def delete_component(self, instance_name: str) -> Any:
        """End a component."""

        def delete() -> ReturnCode:
            if self._references.fixed:
                return ReturnCode.UNSUPPORTED
            try:
                self._manager.delete(instance_name)
            except RtcRefused as error:
                return error.code
            return ReturnCode.RTC_OK

        return self._references.code(self._calls.call(delete))

    def get_profile(self) -> Any:
        """Return how it is called."""
        return self._rtm.ManagerProfile(nvlist(self._profile()))

    def get_configuration(self) -> list[Any]:
        """Return its settings."""
        return nvlist({f"manager.{key}": text for key, text in self._profile().items()})

    def get_factory_profiles(self) -> list[Any]:
        """Return the types of components that it can create."""
        names = self._calls.call(lambda: self._manager.types)
        facts = {"language": "Python", "lang_type": "SCRIPT"}
        return [
            self._rtm.ModuleProfile(nvlist({"implementation_id": name, "type_name": name, **facts}))
            for name in names
        ]

    def get_loadable_modules(self) -> list[Any]:
        """Return none, as those that follow."""
        return []

    get_loaded_modules = get_master_managers = get_slave_managers = get_loadable_modules

    def is_master(self) -> bool:
        """Return True: nobody commands it."""
        return True

    def shutdown(self) -> Any:
        """End the process, as Ctrl-C does."""
        self._calls.post(self._stop)
        return self._references.code(ReturnCode.RTC_OK)

    def fork(self, *_: object) -> Any:
        """Refuse, as all that follow."""
        return self._references.code(ReturnCode.UNSUPPORTED)

    restart = set_configuration = load_module = unload_module = fork
    add_master_manager = remove_master_manager = fork
    add_slave_manager = remove_slave_manager = fork

    def get_service(self, name: str) -> Reference:
        """Return nil: there is none."""
        return None

    def _profile(self) -> dict[str, str]:
        system = platform.uname()
        known = {
            "name": NAME,
            "instance_name": NAME,
            "is_master": "YES",
            "pid": str(os.getpid()),
            "language": "Python",
            "os.name": system.system,
            "os.release": system.release,
            "os.version": system.version,
            "os.arch": system.machine,
            "os.hostname": system.node,
        }
        return known | dict.fromkeys(_UNSET, "")

    def _create(self, type_name: str, options: dict[str, str]) -> Reference:
        if self._references.fixed:
            return None
        try:
            rate_hz = float(options.get(_RATE, DEFAULT_RATE_HZ))
            name = options.get("instance_name", "")
            component = self._manager.create(type_name, name, rate_hz)
        except Exception as error:  # a user's constructor may raise anything
            _LOG.warning("OpenRTM: create %s: %s", type_name, error)
            return None
        return self._references.of(component)


def _option(word: str) -> tuple[str, str]:
    key, _, value = word.partition("=")
    return key, value
