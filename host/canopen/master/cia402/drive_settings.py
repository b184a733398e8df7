"""How a drive is driven, as its bus.yml says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tickrig.host.canopen.bus_file.bus_values import BusSlave, Channel
from tickrig.host.canopen.bus_file.known_keys import SETTINGS
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


@dataclass(frozen=True, slots=True)
class DriveSettings:
    """How an axis is driven.

    Attributes:
        channel: its name, its scales and offsets.
        axis: 0 for the first axis of the device.
        switching_state: in this state the mode is changed.
        homing_us: how long homing may take.
    """

    channel: Channel
    axis: int = 0
    switching_state: DriveState = DriveState.OPERATION_ENABLED
    homing_us: int = 1_000_000 * HOMING_S


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
