from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from omniORB import any as omni_any

from tests.host.rtc.engines.openrtm.extra import OMNIORB
from tests.host.rtc.engines.openrtm.servants.served_system import ServedSystem

pytestmark = [OMNIORB, pytest.mark.realtime]


def values(found: Any) -> dict[str, str]:
    return {item.name: item.value.value() for item in found.configuration_data}


def one_set(system: ServedSystem, set_id: str, **data: object) -> Any:
    sdo = system.idl.sdo
    items = [sdo.NameValue(name, omni_any.to_any(value)) for name, value in data.items()]
    return sdo.ConfigurationSet(set_id, "", items)


@pytest.fixture
def configuration(system: ServedSystem) -> Any:
    return system.component("ConfigSample0").get_configuration()


def test_sets_are_read_with_those_for_editors(configuration: Any) -> None:
    sets = {found.id: values(found) for found in configuration.get_configuration_sets()}
    assert list(sets) == ["default", "__widget__", "__constraints__"]
    assert sets["default"]["int_param0"] == "0"
    assert sets["__widget__"]["str_param1"] == "radio"
    assert sets["__constraints__"]["str_param1"] == "(hoge, fuga, foo)"
    assert values(configuration.get_configuration_set("default")) == sets["default"]
    assert configuration.get_active_configuration_set().id == "default"


def test_values_of_any_type_are_set(system: ServedSystem, configuration: Any) -> None:
    change = one_set(system, "default", int_param0=7, double_param0=0.5, vector_param0=[1.0, 2.0])
    assert configuration.set_configuration_set_values(change)
    found = values(configuration.get_configuration_set("default"))
    assert (found["int_param0"], found["double_param0"]) == ("7", "0.5")
    assert found["vector_param0"] == "1.0,2.0"
    assert found["str_param0"] == "dara"


def test_a_change_is_made_as_a_whole_or_not_at_all(
    system: ServedSystem, configuration: Any
) -> None:
    wrong = one_set(system, "default", int_param0="8", double_param0="much")
    with pytest.raises(system.idl.sdo.InvalidParameter) as caught:
        configuration.set_configuration_set_values(wrong)
    assert caught.value.description == "double_param0 takes a value like 0.11 (float)"
    assert values(configuration.get_configuration_set("default"))["int_param0"] == "0"


def test_sets_are_added_activated_and_removed(system: ServedSystem, configuration: Any) -> None:
    fast = one_set(system, "fast", int_param0="99")
    assert configuration.add_configuration_set(fast)
    assert not configuration.add_configuration_set(fast)
    assert configuration.activate_configuration_set("fast")
    assert configuration.get_active_configuration_set().id == "fast"
    with pytest.raises(system.idl.sdo.InvalidParameter):
        configuration.remove_configuration_set("fast")
    assert configuration.activate_configuration_set("default")
    assert configuration.remove_configuration_set("fast")
    with pytest.raises(system.idl.sdo.NotAvailable):
        configuration.get_configuration_set("fast")


def test_what_is_not_there_cannot_be_changed(system: ServedSystem, configuration: Any) -> None:
    wrong = system.idl.sdo.InvalidParameter
    changes: list[Callable[[], object]] = [
        lambda: configuration.set_configuration_set_values(one_set(system, "none")),
        lambda: configuration.set_configuration_set_values(one_set(system, "default", x="1")),
        lambda: configuration.add_configuration_set(one_set(system, "new", x="1")),
        lambda: configuration.activate_configuration_set("none"),
        lambda: configuration.remove_configuration_set("none"),
        lambda: configuration.get_configuration_parameter_value("x"),
        lambda: configuration.set_configuration_parameter("x", omni_any.to_any("1")),
    ]
    for change in changes:
        with pytest.raises(wrong):
            change()
    assert configuration.get_configuration_parameters() == []
    assert configuration.get_configuration_parameter_values() == []


def test_what_is_for_editors_is_not_changed(system: ServedSystem, configuration: Any) -> None:
    same = configuration.get_configuration_set("__widget__")
    assert configuration.set_configuration_set_values(same)  # as rtresurrect does
    with pytest.raises(system.idl.sdo.InvalidParameter):
        configuration.set_configuration_set_values(one_set(system, "__widget__", int_param0="x"))
    with pytest.raises(system.idl.sdo.InvalidParameter):
        configuration.activate_configuration_set("__widget__")


def test_services_and_organizations_of_peers_are_not_taken(
    system: ServedSystem, configuration: Any
) -> None:
    sdo = system.idl.sdo
    assert not configuration.add_service_profile(sdo.ServiceProfile("a", "b", [], None))
    assert not configuration.remove_service_profile("a")
    assert not configuration.add_organization(None)
    assert not configuration.remove_organization("a")
    assert not configuration.set_device_profile(sdo.DeviceProfile("", "", "", "", []))
