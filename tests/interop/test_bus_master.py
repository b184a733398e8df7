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
from tickrig.host.links.can_link import INTERFACE, CanLink
from tickrig.host.links.echo import EchoFreeLink
from tickrig.testing import open_master

pytestmark = pytest.mark.realtime

SLOW = (
    ("sync_period: 10000\n", "sync_period: 50000\n"),
    ("period: 10\n", "period: 50\n"),
    ("heartbeat_producer: 100\n", "heartbeat_producer: 1000\n  heartbeat_multiplier: 20\n"),
)
"""So that a machine that has much else to do is no failure."""

NODE = "  sdo: [{index: 0x6098, value: 35}]\nnodes:\n  joint: {node_id: 2}\n"


@pytest.fixture(scope="module")
def bus_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder, text = tmp_path_factory.mktemp("bus"), MASTER + PDOS + NODE
    for quick, slow in SLOW:
        text = text.replace(quick, slow)
    (folder / "drive.eds").write_text(eds())
    (folder / "bus.yml").write_text(text)
    return folder / "bus.yml"


@pytest.fixture(scope="module")
def master(bus: Bus, bus_file: Path) -> Iterator[CanopenMaster]:
    """Boot the drive of a bus.yml, which runs in a process of its own."""
    with running(bus, "--bus", str(bus_file)):
        link = CanLink(can.Bus(**bus.keywords), bus.interface)
        echo_free = EchoFreeLink(link) if bus.interface == INTERFACE else link
        with open_master(echo_free, bus_file, sdo_timeout_us=5_000_000) as master:
            master.boot("60s")
            master.perform(master.joints["joint"].init())
            yield master


def reach(master: CanopenMaster, joint: DriveDriver, mode: str, target: float) -> bool:
    """Choose a mode, set its target, wait until the joint has it."""
    master.perform(joint.choose(mode))
    joint.set_target(target)
    shown = "position" if mode in {"pp", "csp", "ip"} else "velocity"
    return master.wait_until(lambda: abs(getattr(joint, shown) - target) < 0.03, "30s")


@pytest.mark.parametrize(
    ("mode", "target"),
    [("pp", 1.0), ("pv", 0.4), ("ip", 0.5), ("csp", 0.8), ("csv", -0.3)],
)
def test_each_mode_moves_a_joint(master: CanopenMaster, mode: str, target: float) -> None:
    joint = master.joints["joint"]
    assert reach(master, joint, mode, target), (joint.position, joint.velocity, joint.state)
    master.perform(joint.choose("pv"))
    joint.set_target(0.0)
    assert master.wait_until(lambda: abs(joint.velocity) < 0.01, "30s")


@pytest.mark.parametrize("mode", ["tq", "cst"])
def test_a_torque_accelerates_a_joint(master: CanopenMaster, mode: str) -> None:
    joint = master.joints["joint"]
    master.perform(joint.choose(mode))
    joint.set_target(150)
    assert master.wait_until(lambda: joint.velocity > 0.3, "30s")
    master.perform(joint.choose("pv"))
    joint.set_target(0.0)
    assert master.wait_until(lambda: abs(joint.velocity) < 0.01, "30s")


def test_a_joint_homes_again(master: CanopenMaster) -> None:
    joint = master.joints["joint"]
    master.perform(joint.init())
    assert abs(joint.position) < 0.05


def test_the_slave_was_not_lost_and_refused_nothing(master: CanopenMaster) -> None:
    assert master.slave("joint").lost == 0
    assert master.joints["joint"].refusals == []
