"""A component as peers see it (OMG RTC 1.0, RTObject; SDO 1.0, SDO)."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, Final

from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.engines.openrtm.context import ServantReferences
from tickrig.host.rtc.engines.openrtm.orb import Reference, nvlist
from tickrig.host.rtc.engines.openrtm.port_service import ComponentPorts
from tickrig.host.rtc.states import ReturnCode
from tickrig.host.rtc.system.manager import Manager

INTERFACE: Final = "OpenRTM.DataFlowComponent"


class RtObjectServant:
    """CORBA object by which other processes use a component: its ports, states and configuration.

    Its methods are the operations of the IDL. Organizations and composite components are not
    emulated, so their lists are empty. Other processes cannot add services.

    Args:
        component: component to serve.
        manager: manager of the component.
        references: references of the components.

    Attributes:
        ports: ports of the component, once they are served.
        configuration: CORBA reference of the component's configuration.
    """

    def __init__(
        self, component: RtComponent, manager: Manager, references: ServantReferences
    ) -> None:
        self._component, self._manager, self._references = component, manager, references
        self._calls, self._stubs = references.calls, references.stubs
        self.ports: ComponentPorts | None = None
        self.configuration: Reference = None

    def get_component_profile(self) -> Any:
        """Return the profile of the component."""
        profiles = [port.get_port_profile() for port in self.get_ports()]
        return self._stubs.rtc.ComponentProfile(
            **asdict(self._component.spec),
            instance_name=self._component.instance_name,
            port_profiles=profiles,
            parent=None,
            properties=nvlist(_properties_of(self._component)),
        )

    def get_ports(self) -> list[Reference]:
        """Return the ports of the component."""
        return [] if self.ports is None else self.ports.services()

    def initialize(self) -> Any:
        """Refuse the request, because the manager has already initialized the component."""
        return self._code(self._component.initialize)

    def finalize(self) -> Any:
        """Refuse the request, because the component takes part in a context. `exit` ends it."""
        return self._code(self._component.finalize)

    def exit(self) -> Any:
        """End the component."""
        return self._code(self._exit)

    on_initialize, on_finalize = initialize, finalize

    def get_sdo_id(self) -> str:
        """Return the instance name of the component."""
        return self._component.instance_name

    def get_sdo_type(self) -> str:
        """Return the description of the component."""
        return self._component.spec.description

    def get_device_profile(self) -> Any:
        """Return the vendor, model and version of the component."""
        spec = self._component.spec
        return self._stubs.sdo.DeviceProfile(
            spec.category, spec.vendor, spec.type_name, spec.version, []
        )

    def get_configuration(self) -> Reference:
        """Return the configuration of the component."""
        return self.configuration

    def get_organizations(self) -> list[Any]:
        """Return an empty list, as the following operations do."""
        return []

    get_owned_organizations = get_service_profiles = get_status_list = get_organizations

    def get_service_profile(self, name: str) -> Any:
        """Refuse the request, as the following operations do, because there are no services."""
        raise self._stubs.sdo.InvalidParameter(f"it has no {name!r}")

    get_sdo_service = get_status = get_service_profile

    def get_monitoring(self) -> Any:
        """Refuse the request, because there is no monitoring."""
        raise self._stubs.sdo.InterfaceNotImplemented("no Monitoring")

    def _exit(self) -> ReturnCode:
        if self._references.fixed:
            return ReturnCode.UNSUPPORTED
        self._manager.delete(self._component.instance_name)
        return ReturnCode.RTC_OK

    def _code(self, call: Any) -> Any:
        return self._references.code(self._calls.call(call))


def _properties_of(component: RtComponent) -> dict[str, str]:
    """Return the properties that OpenRTM has in the profile of a component."""
    spec = component.spec
    return {
        "implementation_id": spec.type_name,
        "type_name": spec.type_name,
        "instance_name": component.instance_name,
        **asdict(spec),
        "language": "Python",
        "lang_type": "SCRIPT",
        "naming.type": "corba",
        **component.profile.properties,
    }
