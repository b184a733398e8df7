"""Put devices on their wires: those of a rig file, or those passed by a test."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from tickrig._lazy import LazyModule
from tickrig.emulators.bench.operator import FaultOrder
from tickrig.emulators.canopen import late
from tickrig.emulators.canopen.choices import AUTO
from tickrig.emulators.commands.device_type import DEVICES, ConfiguredDevice, DeviceType, configure
from tickrig.emulators.rig.emulated import Emulated
from tickrig.emulators.rig.port import ByteLine
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.emulators.serial.rs485_line import Rs485Line
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.bench.bench_rig import BenchRig, Parts, RigState
from tickrig.emulators.testing.bench.mounts import BIT_RATE, BusMount, LineMount, Mount
from tickrig.emulators.testing.bench.recorded_device import node_entry
from tickrig.emulators.testing.rig_file.plan import (
    DeviceKind,
    DevicePlan,
    RigPlan,
    WirePlan,
    WireType,
    seed_of,
)
from tickrig.host.text.bench_header import DeviceEntry
from tickrig.host.text.log import log_of
from tickrig.host.text.trace import Config
from tickrig.host.text.values import Setting

if TYPE_CHECKING:
    from typing_extensions import TypeIs

    from tickrig.device.canopen.slave import CanopenSlave
    from tickrig.emulators.testing.bench.modes.doors import OutsideEnds
    from tickrig.emulators.testing.rig_file import devices as named
    from tickrig.emulators.testing.rig_file import keys, probe
    from tickrig.emulators.testing.signals.sources import SignalSpec
else:  # of devices that a text names
    keys = LazyModule("tickrig.emulators.testing.rig_file.keys")
    named = LazyModule("tickrig.emulators.testing.rig_file.devices")
    probe = LazyModule("tickrig.emulators.testing.rig_file.probe")


_logger = log_of(__name__)


class _NoNodeIdError(ValueError):
    """A CANopen device without a node-ID."""


def parts_of(plan: RigPlan) -> Parts:
    """Make the devices of a rig file, and put them on their wires.

    Raises:
        ValueError: a device cannot be made, for example because its EDS is unreadable. The same
            error is raised if a device type does not know an option, or a signal is invalid.
    """
    alone = len(plan.wires) == 1
    stores: dict[Path, late.StoreFile] = {}
    mounts: list[Mount] = []
    for wire in plan.wires.values():
        devices, seed = plan.devices_on(wire.name), seed_of(plan.seed, wire.name, alone=alone)
        if wire.type is WireType.CAN:
            mounts.append(_bus(wire, devices, seed, stores))
        elif devices:
            mounts.append(_line(wire, devices, seed))
    nodes = [node for bus in mounts if isinstance(bus, BusMount) for node in bus.nodes.values()]
    bodies = [plan.body.put_on(nodes)] if plan.body else []
    return Parts(
        mounts=mounts,
        bodies=bodies,
        start={device.name: _settings_of(device.start) for device in plan.devices.values()},
        signals=_signals(plan),
        stores=tuple(stores.values()),
        seed=plan.seed,
    )


def _settings_of(start: Mapping[str, Setting | SignalSpec]) -> dict[str, Setting]:
    return {key: value for key, value in start.items() if isinstance(value, int | float | str)}


def _signals(plan: RigPlan) -> dict[str, SignalSpec]:
    """Return the signals by target `DEVICE/INPUT`, or by name."""
    return {**plan.signals} | {
        f"{device.name}/{name}": value
        for device in plan.devices.values()
        for name, value in device.start.items()
        if not isinstance(value, int | float | str)
    }


def _begin_faults(plan: RigPlan, rig: BenchRig) -> None:
    """Schedule the faults; raise ValueError for an unknown fault or invalid arguments."""
    for fault in plan.faults:
        name = rig.state.full_fault_name(fault.owner, fault.spec.name)
        order = FaultOrder(replace(fault.spec, name=name), 0)
        rig.operator.fault(0, order.begin(0))
        rig.orders.append(order)


def _line(wire: WirePlan, devices: Sequence[DevicePlan], seed: int) -> LineMount:
    made: list[ConfiguredDevice] = [
        device.made.take(device.made_of(seed)) or configure(device.type, device.config, seed)
        for device in devices
    ]
    mount = LineMount(wire.name, *_settings(wire, made))
    for device, configured in zip(devices, made, strict=True):
        entry = DeviceEntry(wire.name, device.type, configured.config)
        mount.add(device.name, configured.device, entry, seed)
    return mount


def _settings(
    wire: WirePlan, made: Sequence[ConfiguredDevice]
) -> tuple[LineSettings, ByteLine | None]:
    """Return the parameters of a line, and the line itself unless the device makes the line."""
    settings = made[0].type.line
    settings = replace(settings, baud=wire.bit_rate or settings.baud)
    if not wire.given:
        return settings, None
    buffer = {} if wire.buffer_bytes is None else {"buffer_bytes": wire.buffer_bytes}
    if wire.type is WireType.SERIAL:
        make = partial(settings.wire, **buffer) if buffer else settings.wire
        if wire.framing != "8N1":
            make = partial(SerialLine, frame_bits=wire.frame_bits, **buffer)
        return replace(settings, wire=make), None
    shared = Rs485Line(
        settings.baud,
        wire.frame_bits,
        ends=len(made) + 1,
        echo=wire.echo,
        bursts=wire.bursts,
        **buffer,
    )
    return settings, shared


def _bus(
    wire: WirePlan, devices: Iterable[DevicePlan], seed: int, stores: dict[Path, late.StoreFile]
) -> BusMount:
    mount = BusMount(wire.name, wire.bit_rate or BIT_RATE, seed)
    for device in devices:
        mount.add(device.name, *_slave_of(device, stores))
    return mount


def _slave_of(
    device: DevicePlan, stores: dict[Path, late.StoreFile]
) -> tuple[CanopenSlave, DeviceEntry]:
    """Return a slave and its trace entry; add its store file to `stores`.

    Raises:
        ValueError: the file of the device cannot be read.
        _NoNodeIdError: the device has no node-ID.
    """
    kind = Path(device.type) if device.kind is DeviceKind.EDS else device.type
    description = late.describe(probe.eds_cache(), kind, device.profile or AUTO)
    for line in late.finding_lines(description.warnings):
        _logger.warning("%s: %s", device.name, line)
    node_id = description.node_id if device.node_id is None else device.node_id
    if node_id is None:
        raise _NoNodeIdError(f"{device.name}: {device.type} gives no node-ID: add node_id = 1..127")
    slave: CanopenSlave | None = device.made.take(device.made_of())
    if slave is None:
        dictionary, memory = description.make_dictionary(), None
        if device.store:
            if device.store not in stores:
                stores[device.store] = late.StoreFile(device.store)
            memory = stores[device.store].nonvolatile(device.name, dictionary)
        limits = device.sdo or late.USUAL
        slave = late.make_slave(dictionary, node_id, memory, description.application, limits)
    profile, files = device.profile or AUTO, description.files
    return slave, node_entry(device.wire, slave, kind, profile, files)


# The rig of a bench, with all settings of its rig file.

_NAME = "bench"


def rig_of(
    parts: Parts,
    plan: RigPlan,
    outside: OutsideEnds | None = None,
    *,
    trace: Path | None = None,
    keeps: bool = True,
) -> BenchRig:
    """Make the rig of a bench from its wires and devices.

    Args:
        parts: the devices on their wires.
        plan: content of the rig file, for its faults.
        outside: connections to the hosts if the bench runs in real time, or None if it runs in
            virtual time.
        trace: path of the recording, or None for no file.
        keeps: whether to record the run in memory if there is no file.

    Raises:
        ValueError: an input, signal or fault is invalid.
        OSError: the file of the recording cannot be opened.
    """
    state = RigState(
        parts,
        bridges=outside.bridges if outside else (),
        clock=outside.clock if outside else None,
        trace=trace,
        keeps=keeps,
    )
    for store in parts.stores:
        state.rig.watchers.append(late.store_keeper(store))
    rig = BenchRig(_NAME, state)
    _begin_faults(plan, rig)
    return rig


# Devices passed by a test.

_BUS: Final = "can"
"""Default bus of nodes."""

if TYPE_CHECKING:
    BenchedDevice = Emulated[bytes] | CanopenSlave | DeviceType | str
else:
    BenchedDevice = Emulated[bytes] | DeviceType | str
"""A device, a device type, or a text like `type` in rig files: the name of a device type or of a
CANopen model, an EDS or DCF file, or `FILE.py:Class`. A model, an EDS or DCF file, or a class may
have a node-ID in front: `5=drive.eds`."""

_NODE: Final = re.compile(r"[0-9]+=")


def _is_slave(device: BenchedDevice) -> TypeIs[CanopenSlave]:
    """Return whether a device is a slave; if nothing has imported slaves, it is none."""
    module = sys.modules.get("tickrig.device.canopen.slave")
    return module is not None and isinstance(device, module.CanopenSlave)


def mounts_of(
    devices: Mapping[str, BenchedDevice],
    seed: int,
    line: LineSettings | None = None,
    sdo_timeout_us: int | None = None,
) -> list[Mount]:
    """Make the devices and wires of a bench.

    Each serial device gets its own line. All CANopen nodes are on one CAN bus.

    Args:
        devices: the keys are the names of the devices. Each value is a device, a device type, or
            the name of a device type.
        seed: seed of all random numbers.
        line: parameters of the serial lines. The default is the parameters of the device type, or
            115200 8N1.
        sdo_timeout_us: time-out of the SDO servers of all nodes, or None to keep the time-outs of
            the nodes.

    Raises:
        ValueError: an object is neither a device nor a device type, or the time-out is 0. A
            time-out without any node raises this error, too.
    """
    mounts: dict[str, Mount] = {}
    for name, device in devices.items():
        plan = named_device(device, Path(), name) if isinstance(device, str) else None
        is_node = plan is not None and plan.kind is not DeviceKind.SERIAL
        if is_node or _is_slave(device):
            mount = mounts.setdefault(_BUS, BusMount(_BUS, seed=seed))
            assert isinstance(mount, BusMount)
            if _is_slave(device):
                _set_timeout(device, sdo_timeout_us)
                mount.add(name, device, node_entry(_BUS, device))
            elif plan is not None:
                if sdo_timeout_us is not None:
                    plan = replace(
                        plan, sdo=replace(plan.sdo or late.USUAL, timeout_us=sdo_timeout_us)
                    )
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
        servers = late.SdoServers.of(slave)
        servers.limit(replace(servers.limits, timeout_us=sdo_timeout_us))


def named_device(text: str, folder: Path, name: str = "") -> DevicePlan:
    """Return the device that a text names in the notation of the key `type` of a rig file.

    Args:
        text: name of a device type, or file of the device. A CANopen device may have its node-ID in
            front: `5=drive.eds`.
        folder: folder of the files.
        name: name of the device on the bench.

    Raises:
        ValueError: the text does not name a device.
    """
    node, _, rest = text.rpartition("=") if _NODE.match(text) else ("", "", text)
    if rest.lower().endswith(named.RIG_SUFFIXES):
        raise ValueError(f"{rest} is a rig file: open_bench({rest!r}) opens its bench")
    kind, place = named.kind_of(rest, folder)
    if node and kind is DeviceKind.SERIAL:
        raise ValueError(f"{text}: {rest} is on no CAN bus, and has no node-ID")
    node_id = keys.node_id(int(node)) if node else None
    return DevicePlan(name=name, kind=kind, type=place, wire=_BUS, node_id=node_id)


def _slave(mount: BusMount, plan: DevicePlan) -> tuple[CanopenSlave, DeviceEntry]:
    """Return a named slave and its trace entry."""
    try:
        slave, entry = _slave_of(plan, {})
    except _NoNodeIdError:
        raise ValueError(
            f"{plan.name}: {plan.type} gives no node-ID: write '5={plan.type}'"
        ) from None
    for other, node in mount.nodes.items():
        if node.slave.configured_id == (taken := slave.configured_id):
            text = f"node-ID {taken} is that of {other!r} already: write '{taken % 127 + 1}=..."
            raise ValueError(f"{plan.name}: {text}'")
    return slave, entry


def _check_device(name: str, device: object) -> None:
    """Raise ValueError unless an object can be a device: classes and numbers cannot."""
    if isinstance(device, type) or not all(hasattr(device, each) for each in ("tick", "inputs")):
        raise ValueError(
            f"{name} is {device!r:.60}, and that is no device: on a bench are devices, device "
            "types and names of types"
        )


_NO_CONFIG: Final[Config] = {}  # a mapping proxy could not be copied with the bench


class _Made(NamedTuple):
    """A device, the parameters of its line, and its trace entry."""

    device: Emulated[bytes]
    line: LineSettings
    type: str = ""
    config: Config = _NO_CONFIG


def _of_type(device: Emulated[bytes] | DeviceType | str, seed: int) -> _Made:
    """Return the given device, or a device made by the given type."""
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
    """Return the default name of a single device.

    >>> name_of("rtc-lite"), name_of("5=eds/drive.eds")
    ('rtc_lite', 'drive')
    """
    if _is_slave(device):
        return f"node{device.configured_id}"
    if isinstance(device, DeviceType):
        device = device.name
    name = device if isinstance(device, str) else type(device).__name__.lower()
    return re.sub(r"\W", "_", Path(name.rpartition("=")[2].rpartition(":")[2]).stem, flags=re.ASCII)
