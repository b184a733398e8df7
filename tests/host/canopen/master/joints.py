"""A bus.yml of drives, and a bench with these drives and its master."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, cast

from tickrig import Bench
from tickrig.device.canopen.models import epos
from tickrig.host.canopen.master.canopen_master import CanopenMaster
from tickrig.host.canopen.master.cia402.drive_driver import DriveDriver
from tickrig.host.links.link import StampedFrames, StampedLink
from tickrig.testing import open_master
from tickrig.wire.can import Frames
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


class LateLink:
    """A bus that takes what a master sends only after a while; nothing is lost.

    Args:
        link: the bus.
        late_us: how late.
    """

    def __init__(self, link: StampedLink, late_us: int) -> None:
        self._link, self._late_us = link, late_us
        self._sent: list[tuple[int, Frames]] = []
        self.receive, self.close = link.receive, link.close

    @property
    def now_us(self) -> int:
        return self._link.now_us

    def send(self, frames: Frames) -> None:
        self._sent.append((self.now_us + self._late_us, frames))

    def receive_stamped(self, timeout_us: int) -> tuple[int, StampedFrames]:
        due_us = self._sent[0][0] if self._sent else self.now_us + timeout_us
        wait_us = max(0, min(timeout_us, due_us - self.now_us))
        now_us, received = self._link.receive_stamped(wait_us)
        while self._sent and self._sent[0][0] <= now_us:
            self._link.send(self._sent.pop(0)[1])
        return now_us, received


@contextmanager
def cell(
    folder: Path,
    more: str = "",
    *,
    pdos: str = PDOS,
    nodes: tuple[int, ...] = (2,),
    late_us: int = 0,
) -> Iterator[Cell]:
    """Write a bus.yml with drives `joint2`, ..., put these on a bench, boot them.

    Args:
        folder: of the bus.yml.
        more: of its defaults.
        pdos: of the drives.
        nodes: their node-IDs.
        late_us: so much later than the master says it the drives hear it.
    """
    (folder / "drive.eds").write_text(eds())
    text = MASTER + pdos + more + "nodes:\n"
    text += "".join(f"  joint{node}: {{node_id: {node}}}\n" for node in nodes)
    (folder / "bus.yml").write_text(text)
    drives: dict[str, Any] = {f"joint{node}": epos.make_epos(node) for node in nodes}
    with Bench(**drives) as bench, opened(bench, folder / "bus.yml", late_us) as master:
        master.boot()
        yield Cell(bench, master, master.joints[f"joint{nodes[0]}"])


def opened(bench: Bench, bus_file: Path, late_us: int) -> CanopenMaster:
    """Return the master of a bench that may hear it late."""
    if not late_us:
        return open_master(bench.link, bus_file)
    late = LateLink(cast(StampedLink, bench.link), late_us)
    return open_master(late, bus_file, sdo_timeout_us=5_000_000)
