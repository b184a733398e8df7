from __future__ import annotations

import threading

import pytest
from omniORB import CORBA

from tests.host.rtc.engines.openrtm.extra import OMNIORB
from tests.host.rtc.engines.openrtm.name_server import DEADLINE_S
from tests.host.rtc.engines.openrtm.servants.served_system import RATE_HZ, ServedSystem
from tests.host.rtc.spy import ERROR
from tickrig.host.rtc import ExecutionContext, ReturnCode

pytestmark = [OMNIORB, pytest.mark.realtime]


def test_its_profile_names_owner_and_participants(system: ServedSystem) -> None:
    context, component = system.context(), system.component()
    profile = context.get_profile()
    assert profile.kind is context.get_kind() is system.idl.rtc.PERIODIC
    assert profile.rate == context.get_rate() == RATE_HZ
    assert profile.owner._is_equivalent(component)
    (participant,) = profile.participants
    assert participant._is_equivalent(component)


def test_who_activates_waits_until_it_is_so(system: ServedSystem) -> None:
    context, component, rtc = system.context(), system.component(), system.idl.rtc
    assert context.get_component_state(component) is rtc.INACTIVE_STATE
    assert context.activate_component(component) is rtc.RTC_OK
    assert context.get_component_state(component) is rtc.ACTIVE_STATE
    assert context.activate_component(component) is rtc.PRECONDITION_NOT_MET
    assert context.deactivate_component(component) is rtc.RTC_OK
    assert context.get_component_state(component) is rtc.INACTIVE_STATE
    assert context.reset_component(component) is rtc.PRECONDITION_NOT_MET


def test_a_callback_that_fails_is_told(system: ServedSystem) -> None:
    context, component, rtc = system.context(), system.component(), system.idl.rtc
    system.spy.results["on_activated"] = ERROR
    assert context.activate_component(component) is rtc.RTC_ERROR
    system.spy.results["on_reset"] = ERROR
    while context.get_component_state(component) is not rtc.ERROR_STATE:
        continue  # a period later
    assert context.reset_component(component) is rtc.RTC_ERROR
    assert context.get_component_state(component) is rtc.ERROR_STATE
    system.spy.results.clear()
    assert context.reset_component(component) is rtc.RTC_OK


def test_a_failing_on_deactivated_leads_to_error(system: ServedSystem) -> None:
    context, component, rtc = system.context(), system.component(), system.idl.rtc
    assert context.activate_component(component) is rtc.RTC_OK
    system.spy.results["on_deactivated"] = ERROR
    assert context.deactivate_component(component) is rtc.RTC_ERROR
    assert context.get_component_state(component) is rtc.ERROR_STATE
    assert "on_aborting" in system.spy.calls


def test_a_context_that_stands_does_not_get_there_in_time(system: ServedSystem) -> None:
    context, component, rtc = system.context(), system.component(), system.idl.rtc
    assert context.is_running()
    assert context.stop() is rtc.RTC_OK
    assert not context.is_running()
    assert context.stop() is rtc.PRECONDITION_NOT_MET
    assert context.activate_component(component) is rtc.RTC_ERROR  # after 1 s
    assert context.start() is rtc.RTC_OK
    while context.get_component_state(component) is not rtc.ACTIVE_STATE:
        continue  # it was asked for


def test_its_rate_can_be_changed(system: ServedSystem) -> None:
    context, rtc = system.context(), system.idl.rtc
    assert context.set_rate(50.0) is rtc.RTC_OK
    assert context.get_rate() == 50.0
    for rate in (0.0, -1.0, float("nan"), float("inf")):
        assert context.set_rate(rate) is rtc.BAD_PARAMETER


def test_another_component_takes_part_and_leaves(system: ServedSystem) -> None:
    context, other, rtc = system.context(), system.component("ConfigSample0"), system.idl.rtc
    assert context.activate_component(other) is rtc.BAD_PARAMETER
    assert context.get_component_state(other) is rtc.CREATED_STATE
    assert context.add_component(other) is rtc.RTC_OK
    assert context.add_component(other) is rtc.PRECONDITION_NOT_MET
    assert len(context.get_profile().participants) == 2
    (taken,) = other.get_participating_contexts()
    assert other.get_context_handle(taken) == 1_000
    assert context.activate_component(other) is rtc.RTC_OK
    assert context.remove_component(other) is rtc.PRECONDITION_NOT_MET
    assert context.deactivate_component(other) is rtc.RTC_OK
    assert context.remove_component(other) is rtc.RTC_OK


def test_what_is_no_component_of_ours_is_refused(system: ServedSystem) -> None:
    context, rtc = system.context(), system.idl.rtc
    foreign = system.manager._unchecked_narrow(rtc.LightweightRTObject)
    assert context.add_component(foreign) is rtc.UNSUPPORTED
    assert context.add_component(None) is rtc.BAD_PARAMETER
    assert context.activate_component(foreign) is rtc.BAD_PARAMETER
    assert context.activate_component(None) is rtc.BAD_PARAMETER
    assert context.get_component_state(None) is rtc.CREATED_STATE


def test_a_manager_that_has_no_time_is_a_time_out(system: ServedSystem) -> None:
    context, component = system.context(), system.component()
    busy, go = threading.Event(), threading.Event()

    def hold(ec: ExecutionContext) -> ReturnCode:
        busy.set()
        go.wait(DEADLINE_S)
        return ReturnCode.RTC_OK

    system.spy.on_reset = hold  # type: ignore[method-assign]
    foreign = system.manager._unchecked_narrow(system.idl.rtc.ExecutionContext)
    handle = component.attach_context(foreign)
    caller = threading.Thread(target=component.on_reset, args=(handle,))
    caller.start()
    assert busy.wait(DEADLINE_S)
    with pytest.raises(CORBA.TIMEOUT):
        context.get_rate()
    go.set()
    caller.join()
    assert context.get_rate() == RATE_HZ


def test_what_is_asked_after_the_end_is_answered(system: ServedSystem) -> None:
    context = system.context()
    system.close()
    with pytest.raises(CORBA.SystemException):
        context.get_rate()
