"""How the server finds nodes and sets them up."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.emulators.can.can_bench import frames
from tests.host.rtc.canopen.bench import PALETTE_AND_MOTOR, Bench
from tests.host.rtc.canopen.components import add_knob
from tickrig.host.rtc import LifeCycleState
from tickrig.host.rtc.canopen.definition import DefinitionError, read_device_file
from tickrig.host.rtc.canopen.events import ServerEventType
from tickrig.host.rtc.canopen.served_node import NodePhase
from tickrig.wire.rtc_types.rtc import TimedOctet

PALETTE = "nodes: [{id: 16, name: Palette0, eds: f-palette.eds, role: device}]\n"
ONE = {16: "f-palette"}

BOOT = """
    710#00 77F#00 610#4000100000000000
    610#4001100000000000 590#4300100091010700 590#4F01100000000000
    610#4000100000000000 590#4300100091010700
    610#4018100100000000 590#4318100100000000
    610#4018100200000000 590#4318100201000000
    610#4018100300000000 590#4318100300000100
    610#4018100400000000 590#4318100401000000
    610#2B17100064000000 590#6017100000000000
"""


def test_a_node_is_asked_for_its_identity_and_given_its_heartbeat_time() -> None:
    bench = Bench(PALETTE, ONE)
    bench.boot()
    assert bench.log.text.startswith(" ".join(BOOT.split()))


def test_the_proxy_is_inactive_and_has_a_port_for_each_pdo_that_is_on() -> None:
    bench = Bench()
    bench.boot()
    bench.run_ms(10)
    assert bench.state(16) is LifeCycleState.INACTIVE
    ports = {name: [*proxy.ports] for name in (16, 32) if (proxy := bench.proxy(name)) is not None}
    assert ports == {16: ["tpdo1", "tpdo2", "tpdo3", "rpdo1"], 32: ["tpdo2", "rpdo2"]}


def test_values_are_written_while_a_node_boots() -> None:
    bench = Bench(PALETTE + "sdo: [{node: 16, index: 0x6426, sub: 1, value: 8, size: 4}]", ONE)
    bench.boot()
    assert bench.devices[16].slave.dictionary[0x6426, 1].number == 8
    assert "610#2326640108000000" in bench.log.text


def test_a_pdo_is_off_while_its_mapping_is_written() -> None:
    pdo = "{mapping: [0x64010110], cob_id: 0x290, type: 255, inhibit_100us: 100, event_ms: 50}"
    bench = Bench(PALETTE[:-3] + f", pdos: {{tpdo2: {pdo}}}}}]", ONE)
    bench.boot()
    sent = [str(heard) for _, heard in bench.log.heard if str(heard).startswith("610#2")]
    assert sent[1:] == [
        "610#2301180190020080",
        "610#2F011A0000000000",
        "610#23011A0110010164",
        "610#2F011A0001000000",
        "610#2F011802FF000000",
        "610#2B01180364000000",
        "610#2B01180532000000",
        "610#2301180190020000",
    ]


def test_a_node_that_comes_later_is_found_by_its_boot_up() -> None:
    bench = Bench(PALETTE, ONE)
    bench.devices[16].physical["power_off"].write(1)
    bench.run_ms(3_300)
    assert bench.server.nodes[16].phase is NodePhase.ABSENT
    bench.devices[16].physical["power_off"].write(0)
    before_us = bench.now_us
    bench.boot()
    assert bench.now_us - before_us < 40_000


def test_a_node_that_runs_already_is_made_pre_operational_and_set_up() -> None:
    bench = Bench(PALETTE, ONE)
    bench.rig.run_for(20_000)
    bench.other.send(frames("000#0110"))
    bench.rig.run_for(20_000)
    bench.link.receive(0)  # the server was not there yet
    bench.boot()
    assert "000#8010" in bench.log.text


def test_a_stopped_node_with_heartbeat_is_reset_as_it_answers_no_sdo() -> None:
    bench = Bench(PALETTE, ONE)
    bench.rig.run_for(20_000)
    bench.other.send(frames("610#2B17100064000000"))
    bench.rig.run_for(20_000)
    bench.other.send(frames("000#0210"))
    bench.rig.run_for(20_000)
    bench.link.receive(0)  # the server was not there yet
    bench.boot()
    assert "000#8110" in bench.log.text


def test_a_node_of_another_kind_is_refused() -> None:
    bench = Bench(models={16: "motor-core-unit", 32: "motor-core-unit"})
    event = bench.run_until(ServerEventType.WRONG_IDENTITY)
    assert (event.node, event.text) == (16, "1000h:00 is 000C0191h, not 00070191h")
    bench.run_ms(300)
    assert bench.server.nodes[16].phase is NodePhase.REFUSED
    assert bench.proxy(16) is None
    assert bench.state(32) is LifeCycleState.INACTIVE


def test_a_refused_value_ends_the_boot_of_that_node_alone() -> None:
    bench = Bench(PALETTE_AND_MOTOR + "sdo: [{node: 16, index: 0x1000, sub: 0, value: 1, size: 4}]")
    event = bench.run_until(ServerEventType.SDO_ABORTED)
    assert (event.node, event.text) == (16, "1000h:00 aborted: 06010002h READ_ONLY")
    bench.run_ms(300)
    assert bench.server.nodes[16].problem == event.text
    assert bench.state(32) is LifeCycleState.INACTIVE


def test_a_node_that_falls_silent_while_it_boots_is_looked_for_again() -> None:
    bench = Bench(PALETTE, ONE)
    bench.run_ms(4)
    bench.devices[16].physical["unplugged"].write(1)
    event = bench.run_until(ServerEventType.SDO_TIMEOUT)
    assert event.text == "1018h:02 was not answered"
    bench.devices[16].physical["unplugged"].write(0)
    bench.boot()


def test_nodes_are_activated_in_their_order_each_when_those_before_are_active() -> None:
    bench = Bench(PALETTE_AND_MOTOR + "start: {order: [32, 16], autoactivate: true}")
    bench.run_ms(500)
    commands = [str(heard) for _, heard in bench.log.heard if str(heard).startswith("000#")]
    assert commands == ["000#0120", "000#0110"]
    assert [bench.state(16), bench.state(32)] == [LifeCycleState.ACTIVE] * 2
    times = [at for at, heard in bench.log.heard if str(heard) in ("720#05", "000#0110")]
    assert times[0] < times[1]


@pytest.mark.parametrize(
    ("ports", "reason"),
    [
        ("{tpdo1: tpdo2}", "Palette0 has a port 'tpdo2' already"),
        ("{}", "a component 'Palette0' is there already"),
    ],
)
def test_a_name_that_is_there_twice_refuses_the_proxy(ports: str, reason: str) -> None:
    bench = Bench(PALETTE[:-3] + f", ports: {ports}}}]\n", ONE)
    if ports == "{}":
        add_knob(bench.server.manager, TimedOctet, "Palette0")
    event = bench.run_until(ServerEventType.PROXY_REFUSED)
    assert (event.node, event.text) == (16, reason)
    bench.run_ms(500)
    assert bench.server.nodes[16].problem == reason


def test_however_often_it_is_told_the_time_the_same_happens() -> None:
    lines = []
    for step_ms in (0.1, 1, 100):
        bench = Bench(PALETTE_AND_MOTOR + "start: {autoactivate: true}")
        for _ in range(round(500 / step_ms)):
            bench.run_ms(step_ms)
        lines.append(bench.log.lines)
    assert lines[0] == lines[1] == lines[2]


def test_on_the_servers_stop_its_nodes_are_reset_and_stopped_if_it_says_so() -> None:
    bench = Bench(PALETTE + "master: {leave: stopped}", ONE)
    bench.boot()
    assert bench.server.stop(bench.now_us) == frames("000#8210 000#0210")
    assert bench.server.manager.components == ()


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("a.txt", "", "the name does not end in .eds, .dcf, .xdd, .xdc"),
        ("none.eds", None, "No such file or directory"),
        ("a.eds", "x", "has no objects"),
        ("b.xdd", "<a>", "b.xdd:1: is no XML: no element found (xml)"),
        ("c.eds", "", "has no objects"),
    ],
)
def test_a_file_that_is_no_eds_is_refused_in_one_line(
    tmp_path: Path, name: str, content: str | None, reason: str
) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_text(content, "utf-8")
    with pytest.raises(DefinitionError) as caught:
        read_device_file(path)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)
