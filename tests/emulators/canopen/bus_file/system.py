"""Systems of joints for tests: files of our own, and a master that drives them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from textwrap import dedent
from typing import Any

import canopen

from tests.emulators.canopen.bus_file.joint_sheet import FOUR_MODES, joint_sheet
from tickrig import Bench, open_bench

ONE_JOINT = """\
master:
  node_id: 1

joint_1:
  node_id: 2
  dcf: joint.eds
"""


def write_system(folder: Path, text: str = ONE_JOINT, modes: int = FOUR_MODES) -> Path:
    """Write a bus.yml and the EDS of its joints, and return the bus.yml."""
    (folder / "joint.eds").write_text(joint_sheet(modes))
    path = folder / "bus.yml"
    path.write_text(dedent(text))
    return path


class Joint:
    """A joint of a bench as a master sees it: by SDO, as a driver without PDOs would."""

    def __init__(self, bench: Bench, node: Any) -> None:
        self.bench, self._sdo = bench, node.sdo

    def write(self, index: int, value: int, size: int, sub: int = 0) -> None:
        """Write a number."""
        data = value.to_bytes(size, "little", signed=value < 0)
        self._sdo.download(index, sub, data)

    def read(self, index: int, sub: int = 0, *, signed: bool = False) -> int:
        """Read a number."""
        return int.from_bytes(self._sdo.upload(index, sub), "little", signed=signed)

    def enable(self, mode: int) -> None:
        """Choose a mode and lead the drive to Operation enabled."""
        self.write(0x6060, mode, 1)
        for controlword in (0x06, 0x07, 0x0F):
            self.write(0x6040, controlword, 2)
            self.bench.run_for("10ms")

    @property
    def statusword(self) -> int:
        """6041h."""
        return self.read(0x6041)


@contextmanager
def joints(path: Path, *node_ids: int, **options: Any) -> Iterator[tuple[Bench, list[Joint]]]:
    """Open the bench of a bus.yml in virtual time, its nodes operational."""
    with open_bench(path, **options) as bench:
        network = bench.canopen_network()
        remote: Any = canopen
        nodes = [remote.RemoteNode(each, remote.ObjectDictionary()) for each in node_ids]
        for node in nodes:
            network.add_node(node)
        bench.run_for("10ms")
        network.nmt.send_command(1)
        bench.run_for("2ms")
        yield bench, [Joint(bench, node) for node in nodes]
        network.disconnect()
