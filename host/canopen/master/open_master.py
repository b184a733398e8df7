"""The master that a bus.yml describes, on a bus."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from tickrig.host.canopen.bus_file.bus_file import BusFile, read_bus_file
from tickrig.host.canopen.master.canopen_master import CanopenMaster
from tickrig.host.canopen.master.cia402.drive_node import DriveNode
from tickrig.host.canopen.master.cia402.drive_settings import axes_of, is_drive, period_us_of
from tickrig.host.canopen.master.from_bus_file import plan_of
from tickrig.host.canopen.master.process_data import ProcessData
from tickrig.host.canopen.master.process_image import ProcessImage
from tickrig.host.links.link import Link

SDO_TIMEOUT_US: Final = 100_000
"""As Lely's master has it, unless told otherwise."""


def open_master(
    link: Link[Any], path: Path | str, *, sdo_timeout_us: int = SDO_TIMEOUT_US
) -> CanopenMaster:
    """Return the master of a bus.yml; it has sent nothing yet.

    Args:
        link: the bus, as `bench.link`, or `CanLink.open("can0", "socketcan")`.
        path: the bus.yml.
        sdo_timeout_us: how long to wait for an SDO response; a loaded machine wants more.

    Returns:
        A master; close it, or use it in a `with` block.

    Raises:
        OSError: the file cannot be read, or software that it names.
        ImportError: PyYAML is not installed.
        ValueError: all that is wrong with the file, each with its line.
        TypeError: a link to a serial line.
    """
    bus = read_bus_file(Path(path))
    if bus.errors:
        raise ValueError("\n".join(str(one) for one in bus.errors))
    return master_of(link, bus, sdo_timeout_us)


def master_of(link: Link[Any], bus: BusFile, sdo_timeout_us: int = SDO_TIMEOUT_US) -> CanopenMaster:
    """Return the master of a bus.yml that was read."""
    master = CanopenMaster(link, replace(plan_of(bus), sdo_timeout_us=sdo_timeout_us))
    slaves = bus.slaves.values()
    images = {slave.node_id: ProcessImage(slave.pdos, master.nmt.send) for slave in slaves}
    drives = tuple(
        DriveNode(
            master.nmt.slaves[slave.node_id],
            images[slave.node_id],
            axes_of(slave),
            period_us_of(slave),
        )
        for slave in slaves
        if is_drive(slave)
    )
    master.attach(ProcessData(images, drives))
    return master
