"""A bus.yml of drives, and a bench with these drives and its master."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from tickrig import Bench
from tickrig.device.canopen.models import epos
from tickrig.host.canopen.master.canopen_master import CanopenMaster
from tickrig.host.canopen.master.cia402.drive_driver import DriveDriver
from tickrig.testing import open_master
from tickrig.wire.canopen.eds.eds_writer import write_eds

MASTER = """
master:
  node_id: 1
  driver: "ros2_canopen::MasterDriver"
  package: canopen_master_driver
  sync_period: 10000
  heartbeat_producer: 100
defaults:
  dcf: drive.eds
  driver: "ros2_canopen::Cia402Driver"
  package: canopen_402_driver
  period: 10
  heartbeat_producer: 100
"""
PDOS = """
  tpdo:
    1:
      enabled: true
      cob_id: auto
      transmission: 1
      mapping: [{index: 0x6041}, {index: 0x6061}]
    2:
      enabled: true
      cob_id: auto
      transmission: 1
      mapping: [{index: 0x6064}, {index: 0x606C}]
  rpdo:
    1:
      enabled: true
      cob_id: auto
      mapping: [{index: 0x6040}, {index: 0x6060}]
    2:
      enabled: true
      cob_id: auto
      mapping: [{index: 0x607A}, {index: 0x60FF}]
"""
NO_PDOS = """
  tpdo: {1: {enabled: false}}
  rpdo: {1: {enabled: false}, 2: {enabled: false}}
"""


@cache
def eds() -> str:
    return write_eds(epos.dictionary().description)


@dataclass
class Cell:
    """A bench of drives, its master, and the first joint."""

    bench: Bench
    master: CanopenMaster
    joint: DriveDriver

    def heard(self) -> list[str]:
        return [line.split()[-1] for line in self.bench.transcript().splitlines()]


@contextmanager
def cell(
    folder: Path, more: str = "", *, pdos: str = PDOS, nodes: tuple[int, ...] = (2,)
) -> Iterator[Cell]:
    """Write a bus.yml with drives `joint2`, ..., put these on a bench, boot them."""
    (folder / "drive.eds").write_text(eds())
    text = MASTER + pdos + more + "nodes:\n"
    text += "".join(f"  joint{node}: {{node_id: {node}}}\n" for node in nodes)
    (folder / "bus.yml").write_text(text)
    drives: dict[str, Any] = {f"joint{node}": epos.make_epos(node) for node in nodes}
    with Bench(**drives) as bench, open_master(bench.link, folder / "bus.yml") as master:
        master.boot()
        yield Cell(bench, master, master.joints[f"joint{nodes[0]}"])
