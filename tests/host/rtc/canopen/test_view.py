"""What tools see of a server, and do to it."""

from __future__ import annotations

import pytest

from tests.host.rtc.canopen.bench import PALETTE_AND_MOTOR, Bench
from tests.host.rtc.canopen.components import add_knob
from tickrig.host.rtc import LifeCycleState, RtcRefused
from tickrig.host.rtc.canopen.definition import PdoLink, PdoName, Role, RtConnection, ServerRefused
from tickrig.host.rtc.canopen.definition_reader import parse_definition
from tickrig.host.rtc.canopen.definition_writer import write_definition
from tickrig.host.rtc.canopen.events import ServerEventType
from tickrig.host.rtc.canopen.served_node import NodePhase
from tickrig.host.rtc.canopen.view import NOT_HEARD, PdoView, PortView, ServerView
from tickrig.wire.can import CanFrame
from tickrig.wire.rtc_types.rtc import TimedShortSeq

SAME_LENGTH = PdoName(16, "tpdo2"), PdoName(32, "rpdo2")


def viewed() -> tuple[Bench, ServerView]:
    bench = Bench()
    return bench, ServerView(bench.server)


def booted() -> tuple[Bench, ServerView]:
    bench, view = viewed()
    bench.boot()
    bench.run_ms(100)
    return bench, view


def test_before_it_was_heard_a_node_is_absent() -> None:
    _, view = viewed()
    node = view.node(16)
    assert (node.phase, node.nmt_state, node.proxy_state) == (NodePhase.ABSENT, "", "")
    assert (node.heartbeat_age_us, node.ports, node.pdos) == (NOT_HEARD, (), ())


def test_a_node_is_shown_with_its_states_ports_and_pdos() -> None:
    _, view = booted()
    view.connect("Palette0.tpdo2", "Motor0.rpdo2")
    palette, motor = view.nodes
    assert (palette.node_id, palette.name, palette.role) == (16, "Palette0", Role.DEVICE)
    assert (palette.nmt_state, palette.proxy_state) == ("PRE_OPERATIONAL", "INACTIVE")
    assert 0 <= palette.heartbeat_age_us <= 100_000
    assert motor.ports == (
        PortView("Motor0.tpdo2", "TimedShortSeq", True, (), PdoName(32, "tpdo2")),
        PortView("Motor0.rpdo2", "TimedShortSeq", False, ("Palette0.tpdo2",), SAME_LENGTH[1]),
    )
    assert palette.pdos[:2] == (
        PdoView(PdoName(16, "rpdo1"), 0x210, 8, 0x1400, 0x1800),
        PdoView(PdoName(16, "tpdo1"), 0x190, 8, 0x1800, 0x1400),
    )
    view.disconnect("Palette0.tpdo2", "Motor0.rpdo2")
    assert view.nodes[1].ports[1].peers == ()


def test_components_and_connections_are_shown_and_one_that_waits_can_be_forgotten() -> None:
    bench, view = booted()
    knob = add_knob(bench.server.manager, TimedShortSeq)
    (shown,) = view.components
    assert shown.ports == (PortView("Knob0.out", "TimedShortSeq", out=True, peers=()),)
    assert (shown.name, shown.type_name, shown.state) == ("Knob0", "Knob", "INACTIVE")
    view.connect("Knob0.out", "Motor0.rpdo2")
    bench.devices[32].physical["unplugged"].write(1)
    bench.run_ms(1_500)
    assert not knob.out.connectors
    assert view.connections == view.waiting
    view.disconnect("Motor0.rpdo2", "Knob0.out")
    assert not view.connections


def test_nodes_are_started_in_their_order() -> None:
    bench, view = booted()
    view.start()
    bench.run_ms(400)
    assert [node.proxy_state for node in view.nodes] == ["ACTIVE", "ACTIVE"]
    view.deactivate("Motor0")
    bench.run_ms(200)
    assert view.node(32).proxy_state == "INACTIVE"
    view.activate("Motor0")
    bench.run_ms(200)
    assert view.node(32).nmt_state == "OPERATIONAL"
    with pytest.raises(RtcRefused, match="it is ACTIVE"):
        view.reset("Motor0")


def test_an_object_is_read_and_written() -> None:
    bench, view = booted()
    name, wrong = view.read(16, 0x1008, 0), view.read(16, 0x1000, 9)
    assert not name.done
    written = view.write(16, 0x6426, 1, bytes.fromhex("08000000"))
    bench.run_ms(20)
    assert (name.done, name.data, name.problem) == (True, b"f-palette", "")
    assert (wrong.done, wrong.data) == (True, b"")
    assert wrong.problem == "1000h:09 aborted: 06090011h NO_SUBINDEX"
    assert (written.done, written.problem) == (True, "")
    assert bench.devices[16].slave.dictionary[0x6426, 1].number == 8


def test_a_transfer_that_a_lost_node_cannot_end_is_given_up() -> None:
    bench, view = booted()
    bench.devices[16].physical["unplugged"].write(1)
    bench.run_ms(250)
    transfer, second = view.read(16, 0x1008, 0), view.read(16, 0x1009, 0)
    bench.run_ms(400)
    for one in (transfer, second):
        assert one.problem == "given up: the node was reset, stopped or lost"


def test_a_transfer_that_is_not_answered_hides_no_foreign_command() -> None:
    bench, view = booted()
    bench.activate()
    bench.other.send((CanFrame.parse("000#0210"),))
    bench.run_ms(1)
    transfer = view.read(16, 0x1008, 0)
    bench.run_ms(150)
    assert not transfer.done
    assert bench.state(16) is LifeCycleState.ERROR
    assert bench.events(ServerEventType.FOREIGN_TRANSITION)


def test_pdos_of_the_same_length_are_linked_while_the_server_runs() -> None:
    bench, view = booted()
    with pytest.raises(ServerRefused, match=r"16.tpdo1 has 8 bits, 32.rpdo2 has 64"):
        view.link(PdoName(16, "tpdo1"), SAME_LENGTH[1])
    with pytest.raises(ServerRefused, match="node 5 is not ready"):
        view.link(PdoName(5, "tpdo1"), SAME_LENGTH[1])
    view.link(*SAME_LENGTH)
    bench.run_ms(20)
    assert bench.events(ServerEventType.PDO_LINKED) == ["PdoLinked 32 16.tpdo2 to 32.rpdo2: 290h"]
    with pytest.raises(ServerRefused, match=r"16.tpdo2 and 32.rpdo2 are linked"):
        view.link(*SAME_LENGTH)


def test_a_link_to_a_stopped_device_is_refused_as_it_answers_no_sdo() -> None:
    bench, view = booted()
    manager = bench.server.manager
    manager.context_of("Motor0").abort_component(manager.find("Motor0"))
    bench.run_ms(200)
    view.link(*SAME_LENGTH)
    event = bench.run_until(ServerEventType.LINK_REFUSED)
    assert event.text == "16.tpdo2 to 32.rpdo2: 1401h:01 was not answered"


def test_a_link_can_be_ended_and_another_made() -> None:
    bench, view = booted()
    rpdo = bench.devices[32].slave.dictionary[0x1401, 1]
    view.link(*SAME_LENGTH)
    bench.run_ms(20)
    assert rpdo.number == 0x290
    view.unlink(*SAME_LENGTH)
    bench.run_ms(20)
    assert (rpdo.number, view.links) == (0x320, ())
    assert bench.events(ServerEventType.PDO_UNLINKED) == [
        "PdoUnlinked 32 16.tpdo2 to 32.rpdo2: 320h"
    ]
    view.link(PdoName(16, "tpdo3"), SAME_LENGTH[1])
    bench.run_ms(20)
    assert rpdo.number == 0x390
    with pytest.raises(ServerRefused, match=r"16.tpdo2 and 32.rpdo2 are not linked"):
        view.unlink(*SAME_LENGTH)


def test_a_refused_node_can_be_set_up_again() -> None:
    bench = Bench(models={16: "f-palette", 32: "f-palette"})
    view = ServerView(bench.server)
    bench.run_until(ServerEventType.WRONG_IDENTITY)
    assert "not 000C0191h" in view.node(32).problem
    view.boot(32)
    bench.run_ms(50)
    assert len(bench.events(ServerEventType.WRONG_IDENTITY)) == 2
    with pytest.raises(ServerRefused, match="node 5 is not one of: 16, 32"):
        view.boot(5)


def test_what_was_connected_and_linked_is_in_the_definition_that_is_saved() -> None:
    bench, view = booted()
    view.connect("Palette0.tpdo2", "Motor0.rpdo2", {"dataport.subscription_type": "new"})
    view.link(*SAME_LENGTH)
    saved = parse_definition(write_definition(view.definition()))
    assert saved.nodes == parse_definition(PALETTE_AND_MOTOR).nodes
    assert saved.pdo_links == (PdoLink(*SAME_LENGTH),)
    (connection,) = saved.rt_connections
    assert isinstance(connection, RtConnection)
    assert connection.properties["dataport.subscription_type"] == "new"
    again = Bench(write_definition(saved))
    again.boot()
    again.run_ms(50)
    assert again.server.manager.connectors == bench.server.manager.connectors
