"""Another node outside with the node-ID of one of ours; the clock never waits."""

from __future__ import annotations

from collections.abc import Iterator

import can
import pytest

from tests.emulators.can.can_bench import frames
from tests.emulators.can.test_can_rig import Clock
from tickrig.device.canopen.models import epos
from tickrig.emulators.can.emulator import CanEmulator
from tickrig.emulators.can.outside.bus_port import port_on
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.build import make_bench
from tickrig.emulators.canopen.node import Node
from tickrig.host.links.can_link import to_message

CHANNEL = "second_node"


@pytest.fixture
def other() -> Iterator[can.BusABC]:
    with can.Bus(interface="virtual", channel=CHANNEL) as bus:
        yield bus


@pytest.fixture
def emulator(other: can.BusABC) -> Iterator[CanEmulator]:
    wire = CanWire()
    nodes = [Node(str(number), epos.make_epos(number), wire) for number in (5, 6)]
    with can.Bus(interface="virtual", channel=CHANNEL) as bus:
        yield make_bench(wire, nodes, outside=port_on(bus, "virtual"), clock=Clock())


def said(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [record.getMessage() for record in caplog.records]


def hear(emulator: CanEmulator, other: can.BusABC, text: str) -> None:
    for frame in frames(text):
        other.send(to_message(frame))
    emulator.rig.run_to(emulator.rig.now_us + 20_000)


def test_a_second_node_of_a_node_id_is_told_once(
    emulator: CanEmulator, other: can.BusABC, caplog: pytest.LogCaptureFixture
) -> None:
    hear(emulator, other, "705#00 705#7F 706#05 705#7F")
    assert said(caplog) == [
        "node-ID 5 is on the bus twice: another node sent 705#00; stop one of the two",
        "node-ID 6 is on the bus twice: another node sent 706#05; stop one of the two",
    ]
    hear(emulator, other, "705#7F")
    assert len(said(caplog)) == 2


@pytest.mark.parametrize("frame", ["585#6040600000000000", "085#0000000000000000"])
def test_an_answer_or_an_emcy_of_a_second_node_is_told(
    emulator: CanEmulator, other: can.BusABC, caplog: pytest.LogCaptureFixture, frame: str
) -> None:
    hear(emulator, other, f"{frame} 080# 587#6040600000000000")
    text = f"node-ID 5 is on the bus twice: another node sent {frame}; stop one of the two"
    assert said(caplog) == [text]


def test_the_master_guarding_and_other_nodes_are_none(
    emulator: CanEmulator, other: can.BusABC, caplog: pytest.LogCaptureFixture
) -> None:
    hear(emulator, other, "701#05 705#R 00000705#00 605#4000100000000000 77F#7F 707#00")
    assert said(caplog) == []


def test_while_ours_is_off_another_one_may_stand_in(
    emulator: CanEmulator, other: can.BusABC, caplog: pytest.LogCaptureFixture
) -> None:
    emulator.operator.set("5/power_off", 1)
    hear(emulator, other, "705#00")
    assert said(caplog) == []
