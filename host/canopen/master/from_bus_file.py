"""The configuration of a master from a bus.yml."""

from __future__ import annotations

from pathlib import Path

from tickrig.host.canopen.bus_file.bus_file import BusFile
from tickrig.host.canopen.bus_file.bus_values import BusMaster, BusSlave
from tickrig.host.canopen.master.assignment import MasterPlan, ObjectWrite, SlaveAssignment


def plan_of(bus: BusFile) -> MasterPlan:
    """Return the settings of the master and its slaves that a bus.yml describes.

    Raises:
        ValueError: the bus.yml has no section for a master.
        OSError: a software file that the bus.yml names cannot be read.
    """
    master = bus.master
    if master is None:
        raise ValueError(f"{bus.path}: it has no section master")
    return MasterPlan(
        tuple(_assignment(slave, master, bus.path.parent) for slave in bus.slaves.values()),
        node_id=master.node_id,
        starts=master.start,
        starts_nodes=master.start_nodes,
        starts_all=master.start_all_nodes,
        resets_all=master.reset_all_nodes,
        stops_all=master.stop_all_nodes,
        boot_time_us=1_000 * master.boot_time_ms,
        heartbeat_us=1_000 * master.heartbeat_producer_ms,
        sync_us=master.sync_period_us,
        sync_overflow=master.sync_overflow,
    )


def _assignment(slave: BusSlave, master: BusMaster, folder: Path) -> SlaveAssignment:
    identity = slave.identity
    wait_ms = int(slave.heartbeat_producer_ms * slave.heartbeat_multiplier)
    return SlaveAssignment(
        slave.node_id,
        slave.name,
        boots=slave.boot,
        mandatory=slave.mandatory,
        reset_communication=slave.reset_communication,
        device_type=identity.device_type,
        vendor_id=identity.vendor_id,
        product_code=identity.product_code,
        revision=identity.revision_number,
        serial=identity.serial_number,
        software_version=slave.software_version,
        program=_program(slave, folder),
        restore_sub=slave.restore_configuration,
        writes=tuple(ObjectWrite(one.index, one.sub_index, one.data) for one in slave.writes),
        heartbeat_us=1_000 * wait_ms if master.heartbeat_consumer else 0,
        guard_us=1_000 * slave.guard_time_ms,
        life_time_factor=slave.retry_factor,
    )


def _program(slave: BusSlave, folder: Path) -> bytes:
    """Return the software of a slave, empty if the software is not compared."""
    if not (slave.software_file and slave.software_version):
        return b""
    return (folder / slave.software_file).read_bytes()
