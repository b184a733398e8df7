"""Our master of a bus.yml and our slaves in processes of their own, in real time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import can
import pytest

from tests.host.canopen.master.joints import MASTER, PDOS, eds
from tests.interop.buses import Bus
from tests.interop.slave import running
from tickrig.host.canopen.master.canopen_master import CanopenMaster
from tickrig.host.canopen.master.cia402.drive_driver import DriveDriver
from tickrig.host.links.can_link import INTERFACE, CanLink, EchoFreeLink
from tickrig.testing import open_master

pytestmark = pytest.mark.realtime

NODES = (2, 3)
HOMING_35 = "  sdo: [{index: 0x6098, value: 35}]\n"


@pytest.fixture(scope="module")
def bus_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bus")
    (folder / "drive.eds").write_text(eds())
    nodes = "".join(f"  joint{node}: {{node_id: {node}}}\n" for node in NODES)
    (folder / "bus.yml").write_text(f"{MASTER}{PDOS}{HOMING_35}nodes:\n{nodes}")
    return folder / "bus.yml"


@pytest.fixture(scope="module")
def master(bus: Bus, bus_file: Path) -> Iterator[CanopenMaster]:
    """Boot two drives that run in two processes."""
    words = [["--model", "epos", "--node-id", str(node)] for node in NODES]
    with running(bus, *words[0]), running(bus, *words[1]):
        link = CanLink(can.Bus(**bus.keywords), bus.interface)
        echo_free = EchoFreeLink(link) if bus.interface == INTERFACE else link
        with open_master(echo_free, bus_file) as master:
            master.boot("30s")
            master.perform(*(joint.init() for joint in master.joints.values()))
            yield master


def reach(master: CanopenMaster, joint: DriveDriver, mode: str, target: float) -> bool:
    """Choose a mode, set its target, wait until the joint has it."""
    master.perform(joint.choose(mode))
    joint.set_target(target)
    shown = "position" if mode in {"pp", "csp", "ip"} else "velocity"
    return master.wait_until(lambda: abs(getattr(joint, shown) - target) < 0.03, "10s")


@pytest.mark.parametrize(
    ("mode", "target"),
    [("pp", 1.0), ("pv", 0.4), ("ip", 0.5), ("csp", 0.8), ("csv", -0.3)],
)
def test_each_mode_moves_a_joint(master: CanopenMaster, mode: str, target: float) -> None:
    joint = master.joints["joint2"]
    assert reach(master, joint, mode, target), (joint.position, joint.velocity, joint.state)
    master.perform(joint.choose("pv"))
    joint.set_target(0.0)
    assert master.wait_until(lambda: abs(joint.velocity) < 0.01, "10s")


@pytest.mark.parametrize("mode", ["tq", "cst"])
def test_a_torque_accelerates_a_joint(master: CanopenMaster, mode: str) -> None:
    joint = master.joints["joint3"]
    master.perform(joint.choose(mode))
    joint.set_target(150)
    assert master.wait_until(lambda: joint.velocity > 0.3, "10s")
    master.perform(joint.choose("pv"))
    joint.set_target(0.0)
    assert master.wait_until(lambda: abs(joint.velocity) < 0.01, "10s")


def test_joints_are_homed_together(master: CanopenMaster) -> None:
    master.perform(*(joint.init() for joint in master.joints.values()))
    assert all(abs(joint.position) < 0.05 for joint in master.joints.values())


def test_no_slave_was_lost_and_none_refused_anything(master: CanopenMaster) -> None:
    assert [slave.lost for slave in master.nmt.slaves.values()] == [0, 0]
    assert [joint.refusals for joint in master.joints.values()] == [[], []]
