"""DeviceRTCs and their proxies."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.emulators.can.can_bench import frames
from tests.host.rtc.canopen.bench import Bench
from tests.host.rtc.canopen.components import add_knob, add_logger
from tickrig.emulators.canopen.models import MODELS
from tickrig.host.rtc import LifeCycleState
from tickrig.host.rtc.canopen.events import ServerEventType
from tickrig.wire.canopen.eds.eds_writer import write_eds
from tickrig.wire.rtc_types.rtc import Time, TimedLong

ACTIVE, ERROR, INACTIVE = LifeCycleState.ACTIVE, LifeCycleState.ERROR, LifeCycleState.INACTIVE
ECHO = "nodes: [{id: 48, name: Echo0, eds: echo.eds, ports: {rpdo1: in, tpdo1: out}}]\n"


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    description = MODELS["rtc-echo"].describe()
    (tmp_path / "echo.eds").write_text(
        write_eds(description.template.description, description.info), "utf-8"
    )
    bench = Bench(ECHO, {48: "rtc-echo"}, tmp_path)
    bench.boot()
    bench.run_ms(120)
    return bench


def rtc_state(bench: Bench) -> object:
    return bench.devices[48].read("rtc_state")


def abort(bench: Bench) -> None:
    manager = bench.server.manager
    manager.context_of("Echo0").abort_component(manager.find("Echo0"))
    bench.run_ms(200)


def test_data_go_to_the_device_and_come_back(bench: Bench) -> None:
    manager = bench.server.manager
    knob, logger = add_knob(manager, TimedLong), add_logger(manager, TimedLong)
    manager.connect("Knob0.out", "Echo0.in")
    manager.connect("Echo0.out", "Logger0.in")
    bench.activate()
    knob.out.write(TimedLong(Time(), -5))
    bench.run_ms(50)
    assert logger.heard[-1][1].data == -5


def test_proxy_and_device_go_through_the_life_cycle_together(bench: Bench) -> None:
    manager = bench.server.manager
    seen = [(bench.state(48), rtc_state(bench))]
    for step in (manager.activate, manager.deactivate, manager.activate):
        step("Echo0")
        bench.run_ms(200)
        seen.append((bench.state(48), rtc_state(bench)))
    abort(bench)
    seen.append((bench.state(48), rtc_state(bench)))
    manager.reset("Echo0")
    bench.run_ms(200)
    seen.append((bench.state(48), rtc_state(bench)))
    states = [INACTIVE, ACTIVE, INACTIVE, ACTIVE, ERROR, INACTIVE]
    assert seen == [(state, state.name.capitalize()) for state in states]


def test_in_error_a_start_of_another_master_changes_nothing(bench: Bench) -> None:
    abort(bench)
    bench.other.send(frames("000#0130"))
    bench.run_ms(300)
    assert (bench.state(48), rtc_state(bench)) == (ERROR, "Error")
    assert bench.events(ServerEventType.FOREIGN_TRANSITION) == []


def test_a_drive_that_cannot_reset_its_fault_is_reset_all_the_same(tmp_path: Path) -> None:
    description = MODELS["rtc-echo"].describe()
    (tmp_path / "echo.eds").write_text(
        write_eds(description.template.description, description.info), "utf-8"
    )
    bench = Bench(ECHO.replace("ports", "role: drive, ports"), {48: "rtc-echo"}, tmp_path)
    bench.boot()
    bench.run_ms(120)
    abort(bench)
    bench.log.heard.clear()
    bench.server.manager.reset("Echo0")  # a DeviceRTC stays Stopped whatever it is told
    bench.run_ms(500)
    commands = [str(heard) for _, heard in bench.log.heard if str(heard).startswith("000#")]
    assert commands == ["000#8030", "000#8130"]
    assert (bench.state(48), rtc_state(bench)) == (INACTIVE, "Inactive")
