"""The registers of the driver (rh3-control, drive protocol: register map A)."""

from __future__ import annotations

from enum import IntEnum, IntFlag
from typing import Final

from tickrig.device.modbus.registers import Register
from tickrig.device.rh3.parameters import COUNTS_PER_RAD, ENCODER_COUNTS

DEVICE_ID: Final = 0x5248
VERSION: Final = 0x0100

INT32: Final = range(-(2**31), 2**31)
SPEED_LIMIT: Final = round(10 * COUNTS_PER_RAD)
"""Counts/s: Velocity_limit 10.0 of the specification, taken as rad/s of the wheel."""
ACCELERATION_LIMIT: Final = round(50 * COUNTS_PER_RAD)
"""Counts/s2: Acceleration_limit 50.0, taken as rad/s2 of the wheel."""
MOST_GAIN: Final = 32_767


class Mode(IntEnum):
    """What the targets mean (0010h)."""

    FREE = 0
    VELOCITY = 1
    POSITION = 2


class Command(IntEnum):
    """What a master tells the driver (0011h)."""

    NONE = 0
    ENABLE = 1
    DISABLE = 2
    STOP = 3
    QUICK_STOP = 4
    CLEAR_FAULT = 5
    ZERO_COUNTERS = 6


class Status(IntFlag):
    """What the driver says of itself (0200h); bits 5 and 6 are ours."""

    ENABLED = 0x01
    MOVING = 0x02
    FAULT = 0x04
    WATCHDOG = 0x08
    CLIPPED = 0x10
    EMERGENCY_STOP = 0x20
    BUMPER = 0x40


class Fault(IntFlag):
    """Why a wheel has no power (0201h, 0202h); ours, the proposal names none."""

    OVER_CURRENT = 0x01
    ENCODER = 0x04
    STALL = 0x08
    EMERGENCY_STOP = 0x10


def _setting(address: int, name: str, text: str, high: int, initial: int) -> Register:
    return Register(address, name, text, high=high, initial=initial, writable=True)


def _wide(
    address: int, name: str, text: str, initial: int = 0, *, target: bool = False
) -> Register:
    low, high = (INT32[0], INT32[-1]) if target else (0, INT32[-1])
    return Register(address, name, text, 2, target, low, high, initial, writable=True)


def _measured(address: int, name: str, text: str, words: int = 1) -> Register:
    return Register(address, name, text, words, signed=words == 2)


TABLE: Final = (
    Register(0x0000, "device_id", "5248h", initial=DEVICE_ID),
    Register(0x0001, "version", "high byte major, low byte minor", initial=VERSION),
    _setting(0x0010, "mode", "0 free, 1 velocity, 2 position", 2, Mode.FREE),
    _setting(0x0011, "command", "1 enable .. 6 zero counters", 6, Command.NONE),
    _setting(0x0012, "watchdog_ms", "silence that stops the base, 0 for never", 0xFFFF, 500),
    _setting(0x0020, "gain_p", "position, 1/s", MOST_GAIN, 10),
    _setting(0x0021, "gain_i", "position, 1/s2", MOST_GAIN, 0),
    _setting(0x0022, "gain_d", "position", MOST_GAIN, 0),
    _setting(0x0023, "gain_vp", "velocity, per mille of torque for a count/ms", MOST_GAIN, 10),
    _setting(0x0024, "gain_vi", "velocity, per mille for a count", MOST_GAIN, 0),
    _setting(0x0025, "gain_vd", "velocity, per mille for a count/ms in a ms", MOST_GAIN, 1),
    _wide(0x0026, "speed_limit", "counts/s", SPEED_LIMIT),
    _wide(0x0028, "acceleration_limit", "counts/s2", ACCELERATION_LIMIT),
    Register(0x002A, "encoder_counts", "counts in a turn of a motor", initial=ENCODER_COUNTS),
    _setting(0x002B, "direction", "bit 0: left runs backward; bit 1: right", 3, 0),
    _wide(0x0100, "target_speed_left", "counts/s", target=True),
    _wide(0x0102, "target_speed_right", "counts/s", target=True),
    _wide(0x0104, "target_position_left", "counts", target=True),
    _wide(0x0106, "target_position_right", "counts", target=True),
    _measured(0x0200, "status", "see Status"),
    _measured(0x0201, "fault_left", "see Fault"),
    _measured(0x0202, "fault_right", "see Fault"),
    _measured(0x0203, "sample", "milliseconds since power-up, modulo 65536"),
    _measured(0x0204, "position_left", "counts", 2),
    _measured(0x0206, "position_right", "counts", 2),
    _measured(0x0208, "speed_left", "counts/s", 2),
    _measured(0x020A, "speed_right", "counts/s", 2),
    _measured(0x020C, "current_left", "mA, two's complement"),
    _measured(0x020D, "current_right", "mA, two's complement"),
)
