"""What a bus.yml says to a master, as the values that it works with."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from tickrig.host.canopen.bus_file.bus_file import BusFile
from tickrig.host.canopen.bus_file.bus_values import BusMaster, BusSlave
from tickrig.host.canopen.bus_file.known_keys import SETTINGS
from tickrig.host.canopen.master.assignment import MasterPlan, ObjectWrite, SlaveAssignment
from tickrig.host.canopen.master.cia402.drive_settings import DriveSettings
from tickrig.host.canopen.master.cia402.drive_state import DriveState

DRIVE_PROFILE: Final = 402
PERIOD_MS: Final = 10
HOMING_S: Final = 10
ENABLED: Final = 5

SWITCHING_STATES: Final = {
    2: DriveState.SWITCH_ON_DISABLED,
    3: DriveState.READY_TO_SWITCH_ON,
    4: DriveState.SWITCHED_ON,
    5: DriveState.OPERATION_ENABLED,
    6: DriveState.QUICK_STOP_ACTIVE,
}
"""`switching_state` of a bus.yml, by its number."""


def plan_of(bus: BusFile) -> MasterPlan:
    """Return what the master of a bus.yml does.

    Raises:
        ValueError: it has no master.
        OSError: software that it names cannot be read.
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
    """Return the software of a slave, nothing where it is not compared."""
    if not (slave.software_file and slave.software_version):
        return b""
    return (folder / slave.software_file).read_bytes()


def is_drive(slave: BusSlave) -> bool:
    """Say whether a slave is driven as a drive: by its driver, or else its device type."""
    if slave.driver:
        return "402" in slave.driver
    return slave.identity.device_type & 0xFFFF == DRIVE_PROFILE


def axes_of(slave: BusSlave) -> tuple[DriveSettings, ...]:
    """Return how the axes of a drive are driven."""
    state = SWITCHING_STATES[_number(slave, "switching_state", ENABLED)]
    homing_us = 1_000_000 * _number(slave, "homing_timeout_seconds", HOMING_S)
    return tuple(
        DriveSettings(channel, axis, state, homing_us)
        for axis, channel in enumerate(slave.channels)
    )


def period_us_of(slave: BusSlave) -> int:
    """Return the period in which ros2_canopen polls a node, 0 if it does with each SYNC."""
    if not _number(slave, "polling", 1):
        return 0
    return 1_000 * _number(slave, "period", PERIOD_MS)


def _number(slave: BusSlave, key: str, default: int) -> int:
    """Return a setting, the default where the driver does not take what is there."""
    item = slave.settings.get(key)
    value = None if item is None else SETTINGS[key].value_of(item)
    return default if value is None else value
