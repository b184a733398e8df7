"""Put devices on their wires: those that a test hands over, or those of a rig file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple

from tickrig.device.canopen.sdo import SdoServers
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.emulators.commands.device_type import DEVICES, DeviceType, configure
from tickrig.emulators.rig.emulated import Emulated
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.emulators.testing.bench.mounts import BusMount, LineMount, Mount
from tickrig.emulators.testing.bench.plan_parts import NoNodeIdError, slave_of
from tickrig.emulators.testing.bench.recorded_device import node_entry
from tickrig.emulators.testing.rig_file.devices import RIG_SUFFIXES, kind_of
from tickrig.emulators.testing.rig_file.plan import DeviceKind, DevicePlan, seed_of
from tickrig.emulators.testing.rig_file.plan import node_id as read_node_id
from tickrig.host.text.bench_header import DeviceEntry
from tickrig.host.text.trace import Config

_BUS: Final = "can"
"""The bus that nodes share where nobody says otherwise."""

BenchedDevice = Emulated[bytes] | CanopenSlave | DeviceType | str
"""A device, a device type, or what a rig file has as `type`: the name of a device type or CANopen
model, an EDS or DCF file, `FILE.py:Class`; the last three with their node-ID: `5=drive.eds`."""

_NODE: Final = re.compile(r"[0-9]+=")


def mounts_of(
    devices: Mapping[str, BenchedDevice],
    seed: int,
    line: LineSettings | None = None,
    sdo_timeout_us: int | None = None,
) -> list[Mount]:
    """Put each serial device on a line of its own, and all nodes on one CAN bus.

    Args:
        devices: by name.
        seed: of all chance.
        line: what the serial lines are like; that of their type, or 115 200 8N1, unless given.
        sdo_timeout_us: of the SDO servers of all nodes; as it is unless given.

    Raises:
        ValueError: something is no device, and no type of one; a time-out of 0, or without a node.
    """
    mounts: dict[str, Mount] = {}
    for name, device in devices.items():
        plan = named_device(device, Path(), name) if isinstance(device, str) else None
        is_node = plan is not None and plan.kind is not DeviceKind.SERIAL
        if is_node or isinstance(device, CanopenSlave):
            mount = mounts.setdefault(_BUS, BusMount(_BUS, seed=seed))
            assert isinstance(mount, BusMount)
            if isinstance(device, CanopenSlave):
                _set_timeout(device, sdo_timeout_us)
                mount.add(name, device, node_entry(_BUS, device))
            elif plan is not None:
                if sdo_timeout_us is not None:
                    plan = replace(plan, sdo=replace(plan.sdo, timeout_us=sdo_timeout_us))
                mount.add(name, *_slave(mount, plan))
            continue
        if not isinstance(device, str | DeviceType):
            _check_device(name, device)
        made = _of_type(device, seed)
        mounts[name] = lone = LineMount(name, line or made.line)
        entry = DeviceEntry(name, made.type, made.config)
        lone.add(name, made.device, entry, seed_of(seed, name, alone=len(devices) == 1))
    if sdo_timeout_us is not None and _BUS not in mounts:
        raise ValueError("sdo_timeout is of CANopen nodes, and none is on this bench")
    return list(mounts.values())


def _set_timeout(slave: CanopenSlave, sdo_timeout_us: int | None) -> None:
    if sdo_timeout_us is not None:
        servers = SdoServers.of(slave)
        servers.limit(replace(servers.limits, timeout_us=sdo_timeout_us))


def named_device(text: str, folder: Path, name: str = "") -> DevicePlan:
    """Return what a text names, as the `type` of a rig file does.

    Args:
        text: a name or file; the node-ID of a CANopen device may be before it: `5=drive.eds`.
        folder: where files are looked for.
        name: of the device.

    Raises:
        ValueError: it names no device.
    """
    node, _, rest = text.rpartition("=") if _NODE.match(text) else ("", "", text)
    if rest.lower().endswith(RIG_SUFFIXES):
        raise ValueError(f"{rest} is a rig file: open_bench({rest!r}) opens its bench")
    kind, place = kind_of(rest, folder)
    if node and kind is DeviceKind.SERIAL:
        raise ValueError(f"{text}: {rest} is on no CAN bus, and has no node-ID")
    node_id = read_node_id(int(node)) if node else None
    return DevicePlan(name=name, kind=kind, type=place, wire=_BUS, node_id=node_id)


def _slave(mount: BusMount, plan: DevicePlan) -> tuple[CanopenSlave, DeviceEntry]:
    """Return a slave that is named, and what a trace says of it."""
    try:
        slave, entry = slave_of(plan, {})
    except NoNodeIdError:
        raise ValueError(
            f"{plan.name}: {plan.type} gives no node-ID: write '5={plan.type}'"
        ) from None
    for other, node in mount.nodes.items():
        if node.slave.configured_id == (taken := slave.configured_id):
            text = f"node-ID {taken} is that of {other!r} already: write '{taken % 127 + 1}=..."
            raise ValueError(f"{plan.name}: {text}'")
    return slave, entry


def _check_device(name: str, device: object) -> None:
    """Raise ValueError unless something can be a device: classes and numbers cannot."""
    if isinstance(device, type) or not all(hasattr(device, each) for each in ("tick", "inputs")):
        raise ValueError(
            f"{name} is {device!r:.60}, and that is no device: on a bench are devices, device "
            "types and names of types"
        )


_NO_CONFIG: Final[Config] = {}  # a mapping proxy could not be copied with the bench


class _Made(NamedTuple):
    """A device, what its line is like, and what a trace says of it."""

    device: Emulated[bytes]
    line: LineSettings
    type: str = ""
    config: Config = _NO_CONFIG


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

    >>> name_of("rtc-lite"), name_of("5=eds/drive.eds")
    ('rtc_lite', 'drive')
    """
    if isinstance(device, CanopenSlave):
        return f"node{device.configured_id}"
    if isinstance(device, DeviceType):
        device = device.name
    name = device if isinstance(device, str) else type(device).__name__.lower()
    return re.sub(r"\W", "_", Path(name.rpartition("=")[2].rpartition(":")[2]).stem, flags=re.ASCII)
