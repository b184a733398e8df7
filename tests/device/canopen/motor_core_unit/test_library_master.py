"""The canopen library sets a motor core unit up and drives it, in virtual time."""

from __future__ import annotations

import io
from typing import Any

import canopen
import pytest

from tests.device.canopen.fig120 import make_motor
from tickrig.device.canopen.models import motor_core_unit
from tickrig.device.canopen.slave import Application
from tickrig.emulators.can.outside.sim_network import SimNetwork
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.canopen.eds.eds_writer import write_eds

NODE_ID = motor_core_unit.NODE_ID


class Desk:
    """A unit on a wire, and the library's view of it."""

    def __init__(self) -> None:
        wire, slave = CanWire(), make_motor()
        self.motor = Application.of(slave)
        self.network = SimNetwork(Rig(Station(slave, wire.end())), wire.end())
        eds = io.StringIO(write_eds(motor_core_unit.dictionary().description))
        eds.name = "motor-core-unit.eds"
        self.node: Any = self.network.add_node(canopen.RemoteNode(NODE_ID, eds))
        self.network.run_for(10_000)

    def start(self) -> None:
        self.node.nmt.state = "OPERATIONAL"
        self.network.run_for(10_000)


@pytest.fixture
def desk() -> Desk:
    return Desk()


def test_sdos_choose_a_mode_and_a_reference(desk: Desk) -> None:
    desk.node.sdo["Mode"].raw = 3
    desk.start()
    desk.node.sdo["Write analogue output 16-bit"][1].raw = -16_384
    desk.network.run_for(1_000_000)
    assert desk.node.sdo["Status"].raw == 3
    assert desk.node.sdo["Read analogue input 16-bit"][1].raw == pytest.approx(-16_384, abs=1)
    assert desk.motor.read("angle_deg") == pytest.approx(-90.0027, abs=0.002)


def test_pdos_carry_references_there_and_measurements_back(desk: Desk) -> None:
    node = desk.node
    node.rpdo.read()
    node.tpdo.read()
    node.sdo["Mode"].raw = 2
    node.rpdo[2][0].raw = 16_384
    heard: list[int] = []
    node.tpdo[2].add_callback(lambda pdo: heard.append(pdo[1].raw))
    desk.start()
    node.rpdo[2].transmit()
    desk.network.run_for(500_000)
    assert heard[0] == 0
    assert heard[-1] == pytest.approx(16_384, rel=0.01)
    assert 10 < len(heard) < 60


def test_a_status_can_be_mapped_by_the_library(desk: Desk) -> None:
    node = desk.node
    node.tpdo.read()
    node.tpdo[1].clear()
    node.tpdo[1].add_variable("Status")
    node.tpdo[1].cob_id, node.tpdo[1].enabled = 0x1A0, True
    node.tpdo[1].save()
    node.sdo["Mode"].raw = 3
    desk.start()
    assert node.tpdo[1]["Status"].raw == 3
    node.sdo["Write analogue output 16-bit"][1].raw = 16_384
    desk.network.run_for(30_000)
    assert node.tpdo[1]["Status"].raw == 1


def test_an_emergency_reaches_the_library_and_is_cleared(desk: Desk) -> None:
    desk.node.sdo["Mode"].raw = 2
    desk.start()
    desk.motor.inputs.set("supply_v", 5)
    error = desk.node.emcy.wait(0x3220, timeout=1)
    assert error.register == 0x05
    assert desk.node.sdo["Status"].raw == 8
    desk.motor.inputs.set("supply_v", 24)
    desk.node.sdo["Mode"].raw = 2
    desk.network.run_for(10_000)
    assert desk.node.emcy.active == []
    assert desk.node.sdo[0x1003][1].raw == 0x3220
