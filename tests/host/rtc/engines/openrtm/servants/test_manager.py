from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.host.rtc.engines.openrtm.extra import OMNIORB
from tests.host.rtc.engines.openrtm.servants.served_system import ServedSystem

pytestmark = [OMNIORB, pytest.mark.realtime]


@pytest.fixture
def fixed() -> Iterator[ServedSystem]:
    """Return a system whose process alone says which components there are."""
    system = ServedSystem(fixed=True)
    try:
        yield system
    finally:
        system.close()


def names(system: ServedSystem) -> list[str]:
    return [one.instance_name for one in system.manager.get_component_profiles()]


def test_it_creates_and_deletes_components(system: ServedSystem) -> None:
    manager, rtc = system.manager, system.idl.rtc
    made = manager.create_component("ConsoleOut?instance_name=Out7&exec_cxt.periodic.rate=20")
    assert made.get_sdo_id() == "Out7"
    assert system.context("Out7").get_rate() == 20.0
    assert manager.create_component("ConsoleOut").get_sdo_id() == "ConsoleOut0"
    assert names(system) == ["Spy0", "ConfigSample0", "Out7", "ConsoleOut0"]
    assert manager.delete_component("Out7") is rtc.RTC_OK
    assert manager.delete_component("Out7") is rtc.BAD_PARAMETER
    assert names(system) == ["Spy0", "ConfigSample0", "ConsoleOut0"]


@pytest.mark.parametrize(
    "word", ["None", "ConsoleOut?instance_name=Spy0", "ConsoleOut?exec_cxt.periodic.rate=fast", ""]
)
def test_what_cannot_be_created_is_nil_and_a_line(
    system: ServedSystem, word: str, caplog: pytest.LogCaptureFixture
) -> None:
    assert system.manager.create_component(word) is None
    assert sum(message.startswith("OpenRTM: create ") for message in caplog.messages) == 1
    assert names(system) == ["Spy0", "ConfigSample0"]


def test_where_components_are_fixed_nobody_makes_ends_or_moves_one(fixed: ServedSystem) -> None:
    manager, rtc = fixed.manager, fixed.idl.rtc
    assert manager.create_component("ConsoleOut") is None
    assert manager.delete_component("Spy0") is rtc.UNSUPPORTED
    assert fixed.component().exit() is rtc.UNSUPPORTED
    assert fixed.context().remove_component(fixed.component()) is rtc.UNSUPPORTED
    assert fixed.context().activate_component(fixed.component()) is rtc.RTC_OK


def test_it_tells_of_itself_and_its_types(system: ServedSystem) -> None:
    manager = system.manager
    profile = {item.name: item.value.value() for item in manager.get_profile().properties}
    assert (profile["instance_name"], profile["language"]) == ("manager", "Python")
    settings = {item.name: item.value.value() for item in manager.get_configuration()}
    assert settings["manager.instance_name"] == "manager"
    types = [
        {item.name: item.value.value() for item in one.properties}["type_name"]
        for one in manager.get_factory_profiles()
    ]
    assert types[:2] == ["ConsoleOut", "ConsoleIn"]


def test_it_has_no_modules_and_no_other_managers(system: ServedSystem) -> None:
    manager, unsupported = system.manager, system.idl.rtc.UNSUPPORTED
    assert manager.is_master()
    assert manager.get_master_managers() == manager.get_slave_managers() == []
    assert manager.get_loadable_modules() == manager.get_loaded_modules() == []
    assert manager.load_module("x.so", "init") is unsupported
    assert manager.unload_module("x.so") is unsupported
    assert manager.set_configuration("a", "b") is unsupported
    assert manager.fork() is manager.restart() is unsupported
    assert manager.add_master_manager(None) is manager.remove_master_manager(None) is unsupported
    assert manager.add_slave_manager(None) is manager.remove_slave_manager(None) is unsupported
    assert manager.get_service("x") is None


def test_who_shuts_it_down_ends_the_process_in_its_own_way(system: ServedSystem) -> None:
    assert system.manager.shutdown() is system.idl.rtc.RTC_OK
    system.join()
