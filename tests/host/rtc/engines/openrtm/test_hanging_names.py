from __future__ import annotations

import pytest

from tests.host.rtc.engines.openrtm.extra import OMNIORB
from tests.host.rtc.engines.openrtm.name_server import OmniNames, eventually
from tests.host.rtc.engines.openrtm.servants.served_system import ServedSystem

pytestmark = [OMNIORB, pytest.mark.realtime]


def test_a_name_server_that_hangs_delays_no_execution_context(
    omni_names: OmniNames, caplog: pytest.LogCaptureFixture
) -> None:
    system = ServedSystem(omni_names.address)
    try:
        component = system.component()
        assert system.context().activate_component(component) is system.idl.rtc.RTC_OK
        omni_names.pause()
        system.spy.taken()
        made = system.manager.create_component("ConsoleOut")  # its name is to be bound
        assert made.get_sdo_id() == "ConsoleOut0"
        eventually(lambda: "no answer within 1 s" in caplog.text, "nobody noticed that it hangs")
        assert system.spy.taken().count("on_execute") > 10  # 100 if the machine is fast
        omni_names.resume()
        eventually(lambda: "answers again" in caplog.text, "nobody noticed that it goes on")
    finally:
        omni_names.resume()
        system.close()
