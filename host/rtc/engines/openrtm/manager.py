"""The manager of this process as rtmgr and RT System Editor see it (OpenRTM-aist, RTM)."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable
from typing import Any, Final

from tickrig.host.rtc.component import ModuleSpec
from tickrig.host.rtc.engines.openrtm.context import ServantReferences
from tickrig.host.rtc.engines.openrtm.orb import Reference, nvlist
from tickrig.host.rtc.states import ReturnCode, RtcRefused
from tickrig.host.rtc.system.manager import DEFAULT_RATE_HZ, Manager
from tickrig.host.text.log import log_of

INTERFACE: Final = "RTM.Manager"
NAME: Final = "manager"
SPEC: Final = ModuleSpec(NAME, category=NAME)

_LOG: Final = log_of(__name__)
_UNSET: Final = (
    *("naming_formats", "refstring_path", "components.precreate", "modules.load_path"),
    *("modules.config_path", "modules.preload", "modules.init_func_prefix"),
    *("modules.init_func_suffix", "modules.download_allowed", "modules.abs_path_allowed"),
)
"""Keys of a profile that rtcat requires."""

_RATE: Final = "exec_cxt.periodic.rate"


class ManagerServant:
    """CORBA object by which OpenRTM tools create and delete components, and end the process.

    Its methods are the operations of the IDL. Operations on modules, other managers and settings
    are not supported. They return UNSUPPORTED or empty lists.

    Args:
        manager: manager to serve.
        references: references of the components.
        stop: function that ends the process.
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
        """Return the profiles of the components."""
        return [component.get_component_profile() for component in self.get_components()]

    def create_component(self, module_name: str) -> Reference:
        """Create a component from `TYPE?instance_name=NAME&...`.

        Return nil if that is impossible.
        """
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
        """Return the name and description of the manager."""
        return self._rtm.ManagerProfile(nvlist(self._profile()))

    def get_configuration(self) -> list[Any]:
        """Return the settings of the manager."""
        return nvlist({f"manager.{key}": text for key, text in self._profile().items()})

    def get_factory_profiles(self) -> list[Any]:
        """Return the types of components that the manager can create."""
        names = self._calls.call(lambda: self._manager.types)
        facts = {"language": "Python", "lang_type": "SCRIPT"}
        return [
            self._rtm.ModuleProfile(nvlist({"implementation_id": name, "type_name": name, **facts}))
            for name in names
        ]

    def get_loadable_modules(self) -> list[Any]:
        """Return an empty list, as the following operations do."""
        return []

    get_loaded_modules = get_master_managers = get_slave_managers = get_loadable_modules

    def is_master(self) -> bool:
        """Return True, because there is no other master manager."""
        return True

    def shutdown(self) -> Any:
        """End the process, as Ctrl-C does."""
        self._calls.post(self._stop)
        return self._references.code(ReturnCode.RTC_OK)

    def fork(self, *_: object) -> Any:
        """Refuse the request, as all following operations do."""
        return self._references.code(ReturnCode.UNSUPPORTED)

    restart = set_configuration = load_module = unload_module = fork
    add_master_manager = remove_master_manager = fork
    add_slave_manager = remove_slave_manager = fork

    def get_service(self, name: str) -> Reference:
        """Return nil, because there is no service."""
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
