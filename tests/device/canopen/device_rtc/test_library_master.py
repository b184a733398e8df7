"""The canopen library, with the EDS alone, walks a gripper through its life cycle."""

from __future__ import annotations

import io
from typing import Any

import canopen
import pytest
from examples.device_rtc_gripper import Gripper

from tests.device.canopen.device_rtc.test_ports import Wide
from tickrig.device.canopen.device_rtc import CanopenComponent, DeviceRtc, make_device_rtc
from tickrig.emulators.can.outside.sim_network import SimNetwork
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.canopen.eds.eds_writer import write_eds
from tickrig.wire.rtc_canopen import object_table


class Desk:
    """A DeviceRTC on a wire, and the library's view of it."""

    def __init__(self, kind: type[CanopenComponent] = Gripper) -> None:
        wire, slave = CanWire(), make_device_rtc(kind, 16)
        self.rtc = DeviceRtc.of(slave)
        self.network = SimNetwork(Rig(Station(slave, wire.end())), wire.end())
        eds = io.StringIO(write_eds(object_table(kind.profile())))
        eds.name = "device.eds"
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


def test_bits_dummies_wide_characters_and_a_fifth_pdo_are_those_of_the_library() -> None:
    desk = Desk(Wide)
    node = desk.node
    node.rpdo.read()
    node.tpdo.read()
    heard: dict[int, list[list[object]]] = {number: [] for number in (1, 5)}
    for number, frames in heard.items():
        node.tpdo[number].add_callback(
            lambda pdo, frames=frames: frames.append([variable.raw for variable in pdo])
        )
    desk.command("OPERATIONAL")
    flags, word = node.rpdo[1], node.rpdo[2]
    assert ([one.length for one in flags], flags.length) == ([1] * 16, 16)
    for variable, value in zip(flags, (1, 0, 1, 0, 0, 0, 0, 0, 0, 1), strict=False):
        variable.raw = value
    flags.transmit()
    word[0].raw, word[1].raw, word[2].raw = "猫", "A", "ß"
    word.transmit()
    desk.network.run_for(10_000)
    assert heard[1][-1] == [1, 0, 1, 0, 0, 0, 0, 0, 0, 1]
    assert node.tpdo[2].data.decode("utf-16-le") == "猫Aß"  # of 16 bits the library reads 8
    assert (node.tpdo[5].cob_id, heard[5][-1]) == (0x2A5, [2])
    assert not node.tpdo[6].enabled


def test_the_library_writes_and_reads_what_sdo_alone_carries() -> None:
    desk = Desk(Wide)
    sdo = desk.node.sdo
    desk.command("OPERATIONAL")
    sdo["label"].raw = "grüß die Katze, die auf dem Dach sitzt".encode("latin-1")
    sdo["path"][1].raw, sdo["path"][2].raw = 0.1, -2.5
    desk.network.run_for(10_000)
    assert sdo["label_out"].raw == "grüß die Katze, die auf dem Dach sitzt"
    assert [sdo["path_out"][sub].raw for sub in (1, 2)] == [0.1, -2.5]
    assert sdo["slow"].raw >= 2
    with pytest.raises(canopen.SdoAbortedError, match="0x06070012"):
        sdo["label"].raw = "x" * 256


def test_the_library_puts_an_off_pdo_on_with_a_cob_id_of_its_own() -> None:
    desk = Desk(Wide)
    node = desk.node
    node.tpdo.read()
    node.tpdo[6].cob_id, node.tpdo[6].enabled = 0x2B5, True
    node.tpdo[6].save()
    desk.command("OPERATIONAL")
    assert node.tpdo[6].data == b"\0\0"
    assert node.tpdo[6].is_received
