"""The canopen library, with the EDS alone, walks a gripper through its life cycle."""

from __future__ import annotations

import io
from typing import Any

import canopen
import pytest
from examples.device_rtc_gripper import Gripper

from tickrig.device.canopen.device_rtc.device import DeviceRtc, make_device_rtc
from tickrig.emulators.can.outside.sim_network import SimNetwork
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.canopen.eds.eds_writer import write_eds
from tickrig.wire.rtc_canopen.objects import object_table


class Desk:
    """A gripper on a wire, and the library's view of it."""

    def __init__(self) -> None:
        wire, slave = CanWire(), make_device_rtc(Gripper, 16)
        self.rtc = DeviceRtc.of(slave)
        self.network = SimNetwork(Rig(Station(slave, wire.end())), wire.end())
        eds = io.StringIO(write_eds(object_table(Gripper.profile())))
        eds.name = "gripper.eds"
        self.node: Any = self.network.add_node(canopen.RemoteNode(16, eds))
        self.network.run_for(10_000)

    def command(self, command: str) -> str:
        """Send a command; return the state that the heartbeats say."""
        self.node.nmt.state = command
        self.network.run_for(250_000)
        return str(self.node.nmt.state)


@pytest.fixture
def desk() -> Desk:
    return Desk()


def test_the_library_walks_through_the_life_cycle(desk: Desk) -> None:
    assert desk.command("OPERATIONAL") == "OPERATIONAL"
    assert desk.command("PRE-OPERATIONAL") == "PRE-OPERATIONAL"
    assert desk.command("STOPPED") == "STOPPED"
    assert desk.rtc.read("rtc_state") == "Error"
    assert desk.command("OPERATIONAL") == "STOPPED"
    assert desk.command("RESET") == "PRE-OPERATIONAL"
    assert desk.rtc.read("rtc_state") == "Inactive"


def test_an_error_of_the_component_is_seen_by_its_heartbeat(desk: Desk) -> None:
    desk.command("OPERATIONAL")
    desk.rtc.inputs.set("motor_dc", 950)
    desk.network.run_for(150_000)
    assert desk.node.nmt.state == "STOPPED"


def test_pdos_of_the_library_are_the_ports(desk: Desk) -> None:
    node = desk.node
    node.rpdo.read()
    node.tpdo.read()
    heard: list[int] = []
    node.tpdo[1].add_callback(lambda pdo: heard.append(pdo["width_um"].raw))
    desk.command("OPERATIONAL")
    node.rpdo[1]["target_um"].raw = 1_200
    node.rpdo[1].transmit()
    desk.network.run_for(100_000)
    assert heard == [0, 500, 1_000, 1_200, 1_200]
    assert node.sdo["moving"].raw == 0
