"""How one axis of a drive is driven, as its bus.yml says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tickrig.host.canopen.bus_file.bus_values import Channel
from tickrig.host.canopen.master.cia402.drive_state import DriveState

HOMING_US: Final = 10_000_000


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
    homing_us: int = HOMING_US
