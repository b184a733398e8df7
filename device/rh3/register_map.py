"""The registers of the driver (rh3-control, drive protocol: register map A)."""

from __future__ import annotations

from typing import Final

from tickrig.device.modbus.registers import Register
from tickrig.device.rh3.parameters import COUNTS_PER_RAD, ENCODER_COUNTS
from tickrig.wire.modbus.rh3 import DEVICE_ID, VERSION, Address, Command, Mode

INT32: Final = range(-(2**31), 2**31)
SPEED_LIMIT: Final = round(10 * COUNTS_PER_RAD)
"""Counts/s: Velocity_limit 10.0 of the specification, taken as rad/s of the wheel."""
ACCELERATION_LIMIT: Final = round(50 * COUNTS_PER_RAD)
"""Counts/s2: Acceleration_limit 50.0, taken as rad/s2 of the wheel."""
MOST_GAIN: Final = 32_767


def _fixed(address: Address, text: str, value: int) -> Register:
    return Register(address, address.name.lower(), text, initial=value)


def _setting(address: Address, text: str, high: int, initial: int) -> Register:
    name = address.name.lower()
    return Register(address, name, text, high=high, initial=initial, writable=True)


def _wide(address: Address, text: str, initial: int = 0, *, target: bool = False) -> Register:
    low, high = (INT32[0], INT32[-1]) if target else (0, INT32[-1])
    name = address.name.lower()
    return Register(address, name, text, 2, target, low, high, initial, writable=True)


def _measured(address: Address, text: str, words: int = 1) -> Register:
    return Register(address, address.name.lower(), text, words, signed=words == 2)


TABLE: Final = (
    _fixed(Address.DEVICE_ID, "5248h", DEVICE_ID),
    _fixed(Address.VERSION, "high byte major, low byte minor", VERSION),
    _setting(Address.MODE, "0 free, 1 velocity, 2 position", 2, Mode.FREE),
    _setting(Address.COMMAND, "1 enable .. 6 zero counters", 6, Command.NONE),
    _setting(Address.WATCHDOG_MS, "silence that stops the base, 0 for never", 0xFFFF, 500),
    _setting(Address.GAIN_P, "position, 1/s", MOST_GAIN, 10),
    _setting(Address.GAIN_I, "position, 1/s2", MOST_GAIN, 0),
    _setting(Address.GAIN_D, "position", MOST_GAIN, 0),
    _setting(Address.GAIN_VP, "velocity, per mille of torque for a count/ms", MOST_GAIN, 10),
    _setting(Address.GAIN_VI, "velocity, per mille for a count", MOST_GAIN, 0),
    _setting(Address.GAIN_VD, "velocity, per mille for a count/ms in a ms", MOST_GAIN, 1),
    _wide(Address.SPEED_LIMIT, "counts/s", SPEED_LIMIT),
    _wide(Address.ACCELERATION_LIMIT, "counts/s2", ACCELERATION_LIMIT),
    _fixed(
        Address.ENCODER_COUNTS,
        "counts in a turn of a motor",
        ENCODER_COUNTS,
    ),
    _setting(Address.DIRECTION, "bit 0: left runs backward; bit 1: right", 3, 0),
    _wide(Address.TARGET_SPEED_LEFT, "counts/s", target=True),
    _wide(Address.TARGET_SPEED_RIGHT, "counts/s", target=True),
    _wide(Address.TARGET_POSITION_LEFT, "counts", target=True),
    _wide(Address.TARGET_POSITION_RIGHT, "counts", target=True),
    _measured(Address.STATUS, "see Status"),
    _measured(Address.FAULT_LEFT, "see Fault"),
    _measured(Address.FAULT_RIGHT, "see Fault"),
    _measured(Address.SAMPLE, "milliseconds since power-up, modulo 65536"),
    _measured(Address.POSITION_LEFT, "counts", 2),
    _measured(Address.POSITION_RIGHT, "counts", 2),
    _measured(Address.SPEED_LEFT, "counts/s", 2),
    _measured(Address.SPEED_RIGHT, "counts/s", 2),
    _measured(Address.CURRENT_LEFT, "mA, two's complement"),
    _measured(Address.CURRENT_RIGHT, "mA, two's complement"),
)
