"""A bus.yml alone makes the slaves and their master: joints with physics, each mode at once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.host.canopen.master.joints import MASTER, PDOS, eds
from tickrig import Bench, open_bench
from tickrig.host.canopen.master.canopen_master import CanopenMaster
from tickrig.testing import open_master
from tickrig.wire.canopen.drive import DriveState

MODES = ("pp", "pv", "ip", "csp", "csv", "tq", "cst")
POSITIONS = {"pp", "ip", "csp"}

SYSTEM = """
  tickrig:
    modes: all
    upper: 1.5
    velocity: 6.0
  sdo:
    - {index: 0x6098, value: 35}
    - {index: 0x6081, value: 4000}
    - {index: 0x6083, value: 20000}
    - {index: 0x6084, value: 20000}
nodes:
"""

HOMING = """{index: 0x6098, value: 18}
    - {index: 0x6099, sub_index: 1, value: 2000}
    - {index: 0x6099, sub_index: 2, value: 200}
    - {index: 0x609A, value: 20000}"""


@contextmanager
def system(folder: Path, nodes: str, more: str = SYSTEM) -> Iterator[tuple[Bench, CanopenMaster]]:
    (folder / "drive.eds").write_text(eds())
    (folder / "bus.yml").write_text(MASTER + PDOS.rstrip() + more + nodes)
    with (
        open_bench(folder / "bus.yml") as bench,
        open_master(bench.link, folder / "bus.yml") as master,
    ):
        master.boot()
        yield bench, master


def test_every_mode_moves_its_own_joint_at_once(tmp_path: Path) -> None:
    nodes = "".join(f"  {mode}: {{node_id: {2 + at}}}\n" for at, mode in enumerate(MODES))
    with system(tmp_path, nodes) as (_, master):
        joints = master.joints
        master.perform(*(joint.init() for joint in joints.values()))
        master.perform(*(joint.choose(name) for name, joint in joints.items()))
        before = {name: joint.position for name, joint in joints.items()}
        for step in range(1, 51):
            for name, joint in joints.items():
                if name in POSITIONS:
                    joint.set_target(0.01 * step)
                else:
                    joint.set_target(0.5 if name in {"pv", "csv"} else 50)
            master.run_for("10ms")
        master.run_for("200ms")
        moved = {name: joint.position - before[name] for name, joint in joints.items()}
        assert {name: round(moved[name], 2) for name in POSITIONS} == dict.fromkeys(POSITIONS, 0.5)
        assert all(moved[name] > 0.1 for name in MODES), moved
        assert all(joint.refusals == [] for joint in joints.values())
        assert [slave.emergencies for slave in master.nmt.slaves.values()] == [[]] * len(MODES)


def test_joints_home_to_their_limit_switches_at_once(tmp_path: Path) -> None:
    nodes = "  left: {node_id: 2}\n  right: {node_id: 3}\n"
    more = SYSTEM.replace("{index: 0x6098, value: 35}", HOMING)
    with system(tmp_path, nodes, more) as (_, master):
        master.perform(*(joint.init() for joint in master.joints.values()))
        for joint in master.joints.values():
            assert joint.state is DriveState.OPERATION_ENABLED
            assert joint.position == pytest.approx(0.0, abs=0.01)
            master.perform(joint.choose("pp"))
            joint.set_target(-0.5)
            assert master.wait_until(lambda one=joint: abs(one.position + 0.5) < 0.01, "5s")  # type: ignore[misc]


def test_a_joint_is_unplugged_by_its_name_and_comes_back(tmp_path: Path) -> None:
    nodes = "  left: {node_id: 2}\n  right: {node_id: 3}\n"
    with system(tmp_path, nodes) as (bench, master):
        bench["left"].fault("unplugged", for_="1s")
        master.run_for("500ms")
        assert [slave.lost for slave in master.nmt.slaves.values()] == [1, 0]
        master.run_for("2s")
        assert master.slave("left").good
        master.perform(master.joints["left"].init())


def test_a_test_waits_for_the_emcy_of_a_joint(tmp_path: Path) -> None:
    nodes = "  left: {node_id: 2}\n  right: {node_id: 3}\n"
    with system(tmp_path, nodes) as (bench, master):
        left, right = master.slave("left"), master.slave("right")
        assert not master.wait_until(lambda: bool(left.emergencies), "100ms")
        bench["left"].fault("encoder_unplugged")
        assert master.wait_until(lambda: 0x7305 in left.emergencies, "1s")
        assert (bench["left"].get("error_code"), right.emergencies) == (0x7305, [])
