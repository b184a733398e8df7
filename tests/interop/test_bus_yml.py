"""`canopen-slave-emu --bus` and a master of the same bus.yml, on a bus, in real time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import can
import pytest

from tests.emulators.canopen.bus_file.system import write_system
from tests.interop.buses import Bus
from tests.interop.slave import running
from tickrig.host.canopen.master.canopen_master import CanopenMaster
from tickrig.host.canopen.master.cia402.drive_driver import DriveDriver
from tickrig.host.links.can_link import INTERFACE, CanLink
from tickrig.host.links.echo import EchoFreeLink
from tickrig.testing import open_master

pytestmark = pytest.mark.realtime

SYSTEM = """\
master:
  node_id: 1
  driver: "ros2_canopen::MasterDriver"
  package: canopen_master_driver
  sync_period: 50000
defaults:
  dcf: joint.eds
  driver: "ros2_canopen::Cia402Driver"
  package: canopen_402_driver
  period: 50
  tickrig: {modes: all}
  sdo:
    - {index: 0x60C2, sub_index: 1, value: 50}
    - {index: 0x60C2, sub_index: 2, value: -3}
    - {index: 0x6098, value: 35}
  tpdo:
    1: {enabled: true, cob_id: auto, transmission: 1, mapping: [{index: 0x6041}, {index: 0x6061}]}
    2: {enabled: true, cob_id: auto, transmission: 1, mapping: [{index: 0x6064}, {index: 0x606C}]}
    3: {enabled: false, cob_id: auto, mapping: []}
    4: {enabled: false, cob_id: auto, mapping: []}
  rpdo:
    1: {enabled: true, cob_id: auto, mapping: [{index: 0x6040}, {index: 0x6060}]}
    2: {enabled: true, cob_id: auto, mapping: [{index: 0x607A}, {index: 0x60FF}]}
nodes:
  joint_1: {node_id: 2}
  joint_2: {node_id: 3}
"""


@pytest.fixture(scope="module")
def master(bus: Bus, tmp_path_factory: pytest.TempPathFactory) -> Iterator[CanopenMaster]:
    """Boot two joints of one file, in a process of their own."""
    path: Path = write_system(tmp_path_factory.mktemp("bus"), SYSTEM)
    with running(bus, "--bus", str(path)):
        link = CanLink(can.Bus(**bus.keywords), bus.interface)
        echo_free = EchoFreeLink(link) if bus.interface == INTERFACE else link
        with open_master(echo_free, path, sdo_timeout_us=5_000_000) as master:
            master.boot("60s")
            master.perform(*(joint.init() for joint in master.joints.values()))
            yield master


def stop(master: CanopenMaster, joint: DriveDriver) -> None:
    master.perform(joint.choose("pv"))
    joint.set_target(0.0)
    assert master.wait_until(lambda: abs(joint.velocity) < 0.05, "30s")


@pytest.mark.parametrize(
    ("mode", "target"), [("pp", 0.5), ("pv", 0.4), ("ip", 0.3), ("csp", 0.6), ("csv", -0.3)]
)
def test_each_mode_moves_a_joint_of_the_file(
    master: CanopenMaster, mode: str, target: float
) -> None:
    joint = master.joints["joint_1"]
    master.perform(joint.choose(mode))
    joint.set_target(target)
    shown = "position" if mode in {"pp", "csp", "ip"} else "velocity"
    assert master.wait_until(lambda: abs(getattr(joint, shown) - target) < 0.03, "30s")
    stop(master, joint)


@pytest.mark.parametrize("mode", ["tq", "cst"])
def test_a_torque_accelerates_a_joint_of_the_file(master: CanopenMaster, mode: str) -> None:
    joint = master.joints["joint_2"]
    master.perform(joint.choose(mode))
    joint.set_target(100)
    assert master.wait_until(lambda: joint.velocity > 0.5, "30s")
    stop(master, joint)


def test_all_joints_were_booted_and_refused_nothing(master: CanopenMaster) -> None:
    for name, joint in master.joints.items():
        assert master.explain(name).endswith("booted")
        assert not joint.refusals
