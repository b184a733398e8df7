"""Nodes that go and come back, with measured times."""

from __future__ import annotations

from tests.host.rtc.canopen.bench import PALETTE_AND_MOTOR, Bench
from tests.host.rtc.canopen.components import add_logger
from tickrig.host.rtc import LifeCycleState
from tickrig.host.rtc.canopen.events import ServerEventType
from tickrig.host.rtc.canopen.served_node import NodePhase
from tickrig.wire.rtc_types.rtc import TimedOctet

ACTIVE, ERROR, INACTIVE = LifeCycleState.ACTIVE, LifeCycleState.ERROR, LifeCycleState.INACTIVE
CONNECTED = PALETTE_AND_MOTOR + "rt_connections: [{from: Palette0.tpdo1, to: Logger0.in}]\n"


def running(text: str = CONNECTED) -> Bench:
    bench = Bench(text)
    add_logger(bench.server.manager, TimedOctet)
    bench.boot()
    bench.activate()
    assert (bench.state(16), bench.state(32)) == (ACTIVE, ACTIVE)
    return bench


def unplug(bench: Bench, node_id: int = 16) -> int:
    """Pull the plug just after a heartbeat; return its time."""
    wanted = f"7{node_id:02X}#05"
    before = len(bench.log.heard)
    while not any(str(heard) == wanted for _, heard in bench.log.heard[before:]):
        bench.run_ms(1)
    bench.devices[node_id].physical["unplugged"].write(1)
    return max(at for at, heard in bench.log.heard if str(heard) == wanted)


def test_an_unplugged_device_is_in_error_within_its_consumer_time() -> None:
    bench = running()
    last_us = unplug(bench)
    event = bench.run_until(ServerEventType.HEARTBEAT_LOST)
    assert (event.node, event.at_us - last_us) == (16, 300_000)
    event = bench.run_until(ServerEventType.STATE_CHANGED)
    assert event.text == "ACTIVE to ERROR"
    assert event.at_us - last_us <= 310_000
    assert bench.state(32) is ACTIVE


def test_its_proxy_is_removed_one_second_later_and_nothing_else_stops() -> None:
    bench = running()
    last_us = unplug(bench)
    event = bench.run_until(ServerEventType.PROXY_REMOVED)
    assert (event.node, event.at_us - last_us) == (16, 1_300_000)
    names = [component.instance_name for component in bench.server.manager.components]
    assert names == ["Logger0", "Motor0"]
    assert bench.state(32) is ACTIVE
    assert bench.server.nodes[16].phase is NodePhase.ABSENT


def test_with_its_plug_it_is_back_with_ports_and_connections() -> None:
    bench = running()
    unplug(bench)
    bench.run_until(ServerEventType.PROXY_REMOVED)
    bench.devices[16].physical["unplugged"].write(0)
    plugged_us = bench.now_us
    event = bench.run_until(ServerEventType.PROXY_MADE)
    assert event.at_us - plugged_us < 130_000  # a heartbeat or a probe, then 25 ms of boot
    bench.run_ms(20)
    assert bench.state(16) is INACTIVE
    assert [c.ports for c in bench.server.manager.connectors] == [("Palette0.tpdo1", "Logger0.in")]
    bench.activate(16)
    assert bench.state(16) is ACTIVE


def test_without_reconnect_it_comes_back_without_connections() -> None:
    bench = running(CONNECTED + "master: {reconnect: false}\n")
    unplug(bench)
    bench.run_until(ServerEventType.PROXY_REMOVED)
    bench.devices[16].physical["unplugged"].write(0)
    bench.run_until(ServerEventType.PROXY_MADE)
    bench.run_ms(20)
    assert bench.server.manager.connectors == ()


def test_with_autoactivate_it_comes_back_active() -> None:
    bench = Bench(PALETTE_AND_MOTOR + "start: {autoactivate: true}\n")
    bench.run_ms(500)
    unplug(bench)
    bench.run_until(ServerEventType.PROXY_REMOVED)
    bench.devices[16].physical["unplugged"].write(0)
    bench.run_ms(500)
    assert bench.state(16) is ACTIVE


def test_a_device_that_was_away_for_a_moment_is_stopped_and_can_be_reset() -> None:
    bench = running()
    unplug(bench)
    bench.run_until(ServerEventType.HEARTBEAT_LOST)
    bench.run_ms(100)
    bench.devices[16].physical["unplugged"].write(0)
    bench.run_ms(300)
    assert bench.state(16) is ERROR
    assert bench.devices[16].read("state") == "Stopped"
    bench.server.manager.reset("Palette0")
    bench.run_ms(200)
    assert bench.state(16) is INACTIVE
    assert bench.events(ServerEventType.PROXY_REMOVED) == []


def test_a_device_that_lost_power_for_a_moment_is_set_up_anew() -> None:
    bench = running()
    bench.devices[16].physical["power_off"].write(1)
    bench.run_ms(50)
    bench.devices[16].physical["power_off"].write(0)
    back_us = bench.now_us
    event = bench.run_until(ServerEventType.PROXY_MADE)
    assert 125_000 < event.at_us - back_us < 155_000  # it is listened for a twin first
    bench.run_ms(20)
    assert bench.state(16) is INACTIVE
    assert bench.events(ServerEventType.DUPLICATE_NODE) == []


def test_bus_off_of_the_server_leaves_all_in_error_until_they_are_reset() -> None:
    bench = running()

    def tell(at_us: int, state: object) -> None:
        bench.server.bus_state(bench.end.controller.state)

    bench.end.on_error_state = tell
    bench.wire.faults.arm("short")
    bench.run_ms(300)
    bench.wire.faults.clear("short")
    assert "BusOff 0 the server can neither hear nor send" in bench.events()
    assert (bench.state(16), bench.state(32)) == (ERROR, ERROR)
    bench.end.recover(bench.now_us)
    bench.run_until(ServerEventType.BUS_ON)
    bench.run_ms(500)
    assert [bench.devices[n].read("state") for n in (16, 32)] == ["Stopped", "Stopped"]
    bench.server.manager.reset("Palette0", "Motor0")
    bench.run_ms(300)
    assert (bench.state(16), bench.state(32)) == (INACTIVE, INACTIVE)


def test_a_link_is_made_again_when_its_target_comes_back_and_kept_when_its_source_does() -> None:
    bench = running(CONNECTED + "pdo_links: [{from: 16.tpdo2, to: 32.rpdo2}]\n")
    for node_id, links in ((16, 1), (32, 2)):
        unplug(bench, node_id)
        bench.run_until(ServerEventType.PROXY_REMOVED, node_id)
        bench.devices[node_id].physical["unplugged"].write(0)
        bench.run_until(ServerEventType.PROXY_MADE, node_id)
        bench.run_ms(50)
        assert len(bench.events(ServerEventType.PDO_LINKED)) == links
