"""Put devices on their wires: those that a test hands over, or those of a rig file."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.emulators.commands.device_config import configure
from tickrig.emulators.commands.device_type import DEVICES, DeviceType
from tickrig.emulators.rig.emulated import Emulated
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.emulators.testing.bench.mounts import BusMount, LineMount, Mount, seed_of
from tickrig.emulators.testing.bench.recorded_device import node_entry
from tickrig.host.text.bench_header import DeviceEntry
from tickrig.host.text.trace import Config

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

    Raises:
        ValueError: something is no device, and no type of one.
    """
    mounts: dict[str, Mount] = {}
    for name, device in devices.items():
        if isinstance(device, CanopenSlave):
            mount = mounts.setdefault(BUS, BusMount(BUS, seed=seed))
            assert isinstance(mount, BusMount)
            mount.add(name, device, node_entry(BUS, device))
            continue
        if not isinstance(device, str | DeviceType):
            _check_device(name, device)
        made = _of_type(device, seed)
        mounts[name] = lone = LineMount(name, line or made.line)
        entry = DeviceEntry(name, made.type, made.config)
        lone.add(name, made.device, entry, seed_of(seed, name, alone=len(devices) == 1))
    return list(mounts.values())


def _check_device(name: str, device: object) -> None:
    """Raise ValueError unless something can be a device: classes and numbers cannot."""
    if isinstance(device, type) or not all(hasattr(device, each) for each in ("tick", "inputs")):
        raise ValueError(
            f"{name} is {device!r:.60}, and that is no device: on a bench are devices, device "
            "types and names of types"
        )


class _Made(NamedTuple):
    """A device, what its line is like, and what a trace says of it."""

    device: Emulated[bytes]
    line: LineSettings
    type: str = ""
    config: Config = MappingProxyType({})


def _of_type(device: Emulated[bytes] | DeviceType | str, seed: int) -> _Made:
    """Return a device that is given, or that its type makes."""
    if isinstance(device, str):
        made = configure(device, {}, seed)
        return _Made(made.device, made.type.line, made.type.name, made.config)
    if isinstance(device, DeviceType):
        return _Made(device.build({}), device.line, device.name)
    name = getattr(device, "type_name", "")
    if not name:
        return _Made(device, LineSettings())
    device_type = DEVICES.load(name)
    config = device_type.config_of(device)
    if config is None:
        return _Made(device, device_type.line)
    return _Made(device, device_type.line, name, config)


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
