from __future__ import annotations

import pytest
from omniORB import CORBA

from tests.host.rtc.engines.openrtm.extra import OMNIORB
from tests.host.rtc.engines.openrtm.servants.served_system import ServedSystem
from tests.host.rtc.spy import ERROR, BrokenError

pytestmark = [OMNIORB, pytest.mark.realtime]


def test_it_is_what_openrtm_narrows_to(system: ServedSystem) -> None:
    component = system.component()
    for kind in (
        "IDL:openrtm.aist.go.jp/OpenRTM/DataFlowComponent:1.0",
        "IDL:omg.org/RTC/RTObject:1.0",
        "IDL:omg.org/RTC/LightweightRTObject:1.0",
        "IDL:omg.org/RTC/DataFlowComponentAction:1.0",
        "IDL:org.omg/SDOPackage/SDO:1.0",
    ):
        assert component._is_a(kind), kind
    assert not component._non_existent()


def test_its_profile_says_what_it_is(system: ServedSystem) -> None:
    profile = system.component("ConfigSample0").get_component_profile()
    assert (profile.instance_name, profile.type_name) == ("ConfigSample0", "ConfigSample")
    assert (profile.vendor, profile.version, profile.category) == ("tickrig", "1.0.0", "generic")
    assert profile.parent is None
    values = {item.name: item.value.value() for item in profile.properties}
    assert values["implementation_id"] == "ConfigSample"
    assert values["language"] == "Python"


def test_as_an_sdo_it_has_an_id_a_type_and_no_organizations(system: ServedSystem) -> None:
    sdo, component = system.idl.sdo, system.component("ConfigSample0")
    assert component.get_sdo_id() == "ConfigSample0"
    assert component.get_sdo_type() == component.get_component_profile().description
    device = component.get_device_profile()
    assert (device.device_type, device.manufacturer, device.model) == (
        "generic",
        "tickrig",
        "ConfigSample",
    )
    assert component.get_organizations() == component.get_owned_organizations() == []
    assert component.get_service_profiles() == component.get_status_list() == []
    for ask in (component.get_service_profile, component.get_sdo_service, component.get_status):
        with pytest.raises(sdo.InvalidParameter):
            ask("x")
    with pytest.raises(sdo.InterfaceNotImplemented):
        component.get_monitoring()


def test_it_is_initialized_and_ends_by_exit_alone(system: ServedSystem) -> None:
    component, code = system.component(), system.idl.rtc
    assert component.initialize() is code.PRECONDITION_NOT_MET
    assert component.finalize() is code.PRECONDITION_NOT_MET
    assert component.on_initialize() is code.PRECONDITION_NOT_MET
    assert component.on_finalize() is code.PRECONDITION_NOT_MET
    assert component.exit() is code.RTC_OK
    assert system.spy.calls[-1] == "on_finalize"
    with pytest.raises(CORBA.OBJECT_NOT_EXIST):
        component.get_sdo_id()


def test_its_own_contexts_have_handles_from_0(system: ServedSystem) -> None:
    component, context = system.component(), system.context()
    assert component.get_participating_contexts() == []
    assert component.get_context_handle(context) == 0
    assert component.get_context(0)._is_equivalent(context)
    assert component.get_context(1) is None
    assert component.is_alive(context)
    assert not component.is_alive(system.context("ConfigSample0"))
    assert not component.is_alive(None)
    assert component.get_context_handle(None) == -1


def test_a_context_of_a_peer_calls_its_callbacks(system: ServedSystem) -> None:
    component, rtc = system.component(), system.idl.rtc
    foreign = system.manager  # any reference that is no context of this component
    foreign = foreign._unchecked_narrow(rtc.ExecutionContext)
    handle = component.attach_context(foreign)
    assert handle == component.attach_context(foreign) == component.get_context_handle(foreign)
    assert component.get_context(handle)._is_equivalent(foreign)
    assert len(component.get_participating_contexts()) == 1
    system.spy.calls.clear()
    names = [
        "on_startup",
        "on_activated",
        "on_execute",
        "on_state_update",
        "on_deactivated",
        "on_aborting",
        "on_error",
        "on_reset",
        "on_rate_changed",
        "on_shutdown",
    ]
    for name in names:
        assert getattr(component, name)(handle) is rtc.RTC_OK
    assert system.spy.taken() == names
    system.spy.results["on_execute"] = ERROR
    assert component.on_execute(handle) is rtc.RTC_ERROR
    system.spy.results["on_execute"] = BrokenError()
    assert component.on_execute(handle) is rtc.RTC_ERROR
    assert component.detach_context(handle) is rtc.RTC_OK
    assert component.on_execute(handle) is rtc.BAD_PARAMETER
    assert component.detach_context(handle) is rtc.BAD_PARAMETER


def test_nobody_calls_the_callbacks_of_our_contexts(system: ServedSystem) -> None:
    component, rtc = system.component(), system.idl.rtc
    system.spy.calls.clear()
    assert component.on_activated(0) is rtc.PRECONDITION_NOT_MET
    assert component.detach_context(0) is rtc.PRECONDITION_NOT_MET
    assert component.attach_context(system.context()) == 0
    assert component.attach_context(None) == -1
    assert system.spy.calls == []
