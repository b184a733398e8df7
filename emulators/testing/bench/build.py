"""Put devices on their wires: those that a test hands over, or those of a rig file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.emulators.commands.device_config import configure
from tickrig.emulators.commands.device_type import DeviceType
from tickrig.emulators.rig.emulated import Emulated
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.emulators.testing.bench.mounts import BusMount, LineMount, Mount, seed_of

BUS: Final = "can"
"""The bus that nodes share where nobody says otherwise."""

BenchedDevice = Emulated[bytes] | CanopenSlave | DeviceType | str
"""A device, a device type, or the name of a type or CANopen model."""


def mounts_of(
    devices: Mapping[str, BenchedDevice], seed: int, line: LineSettings | None = None
) -> list[Mount]:
    """Put each serial device on a line of its own, and all nodes on one CAN bus.

    Args:
        devices: by name.
        seed: of all chance.
        line: what the serial lines are like; that of their type, or 115 200 8N1, unless given.
    """
    mounts: dict[str, Mount] = {}
    for name, device in devices.items():
        if isinstance(device, CanopenSlave):
            mount = mounts.setdefault(BUS, BusMount(BUS, seed=seed))
            assert isinstance(mount, BusMount)
            mount.add(name, device)
            continue
        settings, made = _of_type(device, seed)
        mounts[name] = lone = LineMount(name, line or settings)
        lone.add(name, made, seed_of(seed, name, alone=len(devices) == 1))
    return list(mounts.values())


def _of_type(
    device: Emulated[bytes] | DeviceType | str, seed: int
) -> tuple[LineSettings, Emulated[bytes]]:
    """Return a device and what its line is like."""
    if isinstance(device, str):
        made = configure(device, {}, seed)
        return made.type.line, made.device
    if isinstance(device, DeviceType):
        return device.line, device.build({})
    return LineSettings(), device


def name_of(device: BenchedDevice) -> str:
    """Return what a lone device is called where nobody says it.

    >>> name_of("rtc-lite")
    'rtc_lite'
    """
    if isinstance(device, CanopenSlave):
        return f"node{device.configured_id}"
    if isinstance(device, DeviceType):
        device = device.name
    name = device if isinstance(device, str) else type(device).__name__.lower()
    return name.replace("-", "_")
