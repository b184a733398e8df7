"""The configuration of a component as peers see it (OMG SDO 1.0, Configuration)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, TypeVar

from omniORB import any as omni_any

from tickrig.host.rtc.configuration import Configuration, as_text
from tickrig.host.rtc.engines.openrtm.orb import nvlist
from tickrig.host.rtc.engines.openrtm.stubs import Stubs
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.call_queue import CallQueue

R = TypeVar("R")

INTERFACE: Final = "SDOPackage.Configuration"

_WIDGETS: Final = "__widget__"
_CONSTRAINTS: Final = "__constraints__"
"""Sets with the editor widgets and constraints of the parameters (OpenRTM-aist)."""


class ConfigurationServant:
    """CORBA object by which OpenRTM tools read and change the configuration of a component.

    Its methods are the operations of the IDL. A change is checked as a whole and takes effect in
    the next period. Two more sets, `__widget__` and `__constraints__`, describe the parameters to
    editors. These sets cannot be changed.

    Two parts of the IDL are not emulated: parameters that belong to no set, and the operations that
    add service profiles and organizations (groups of components).

    Args:
        configuration: configuration to serve.
        calls: queue that runs calls in the manager's thread.
        stubs: stubs of Tickrig's IDL.
    """

    def __init__(self, configuration: Configuration, calls: CallQueue, stubs: Stubs) -> None:
        self._configuration, self._calls, self._sdo = configuration, calls, stubs.sdo

    def get_configuration_sets(self) -> list[Any]:
        """Return all sets."""
        return self._calls.call(lambda: [self._set(*item) for item in self._sets().items()])

    def get_configuration_set(self, config_id: str) -> Any:
        """Return a set. Raise NotAvailable if there is no such set."""
        return self._calls.call(lambda: self._found(config_id))

    def get_active_configuration_set(self) -> Any:
        """Return the set whose values apply."""
        return self._calls.call(lambda: self._found(self._configuration.active_id))

    def set_configuration_set_values(self, configuration_set: Any) -> bool:
        """Change values of an existing set, either all values or none."""
        set_id, values = configuration_set.id, _values(configuration_set)
        return self._changed(lambda: self._change(set_id, values))

    def add_configuration_set(self, configuration_set: Any) -> bool:
        """Add a set. Return False if another set has its ID."""
        set_id, values = configuration_set.id, _values(configuration_set)

        def add() -> bool:
            is_new = set_id not in self._sets()
            if is_new:
                self._configuration.add_set(set_id, values)
            return is_new

        return self._changed(add)

    def remove_configuration_set(self, config_id: str) -> bool:
        """Remove a set, except the default set and the active set."""
        return self._changed(lambda: self._configuration.remove_set(config_id))

    def activate_configuration_set(self, config_id: str) -> bool:
        """Activate a set, so that its values apply."""
        return self._changed(lambda: self._configuration.activate(config_id))

    def get_configuration_parameters(self) -> list[Any]:
        """Return no parameters, because all parameters are in sets."""
        return []

    get_configuration_parameter_values = get_configuration_parameters

    def get_configuration_parameter_value(self, name: str, *_: object) -> Any:
        """Refuse the request, because there is no parameter outside of sets."""
        raise self._sdo.InvalidParameter(f"no parameter {name!r} outside of sets")

    set_configuration_parameter = get_configuration_parameter_value

    def set_device_profile(self, profile: Any) -> bool:
        """Refuse the request, as all following operations do."""
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
        """Make a change. If it is impossible, raise InvalidParameter with the reason."""
        try:
            return self._calls.call(change) is not False
        except RtcRefused as error:
            raise self._sdo.InvalidParameter(str(error)) from error


def _values(configuration_set: Any) -> dict[str, str]:
    """Return the values of a set as text, whatever their type is."""
    values = {}
    for item in configuration_set.configuration_data:
        value = omni_any.from_any(item.value)
        values[item.name] = as_text(tuple(value) if isinstance(value, list) else value)
    return values
