"""Make what a rig file says: devices on their wires, what they move, what they begin with."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from tickrig.device.canopen.slave import CanopenSlave
from tickrig.emulators.bench.operator import FaultOrder
from tickrig.emulators.canopen import late
from tickrig.emulators.canopen.choices import AUTO
from tickrig.emulators.canopen.store_file import StoreFile
from tickrig.emulators.commands.device_type import ConfiguredDevice, configure
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
from tickrig.emulators.testing.rig_file.probe import eds_cache
from tickrig.emulators.testing.signals.sources import SignalSpec
from tickrig.host.text.bench_header import DeviceEntry
from tickrig.host.text.log import log_of
from tickrig.host.text.values import Setting

if TYPE_CHECKING:
    from tickrig.emulators.testing.bench.modes.doors import OutsideEnds


_logger = log_of(__name__)


class NoNodeIdError(ValueError):
    """A CANopen device that nobody gives a node-ID."""


def parts_of(plan: RigPlan) -> Parts:
    """Make the devices of a rig file and put them on their wires.

    Raises:
        ValueError: a device cannot be made, such as of an EDS that cannot be read; options that
            its type does not take; a signal that cannot be.
    """
    alone = len(plan.wires) == 1
    stores: dict[Path, StoreFile] = {}
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
    return {key: value for key, value in start.items() if not isinstance(value, SignalSpec)}


def _signals(plan: RigPlan) -> dict[str, SignalSpec]:
    """Return the signals by what they drive, `DEVICE/INPUT`, or by their names."""
    return {**plan.signals} | {
        f"{device.name}/{name}": value
        for device in plan.devices.values()
        for name, value in device.start.items()
        if isinstance(value, SignalSpec)
    }


def _begin_faults(plan: RigPlan, rig: BenchRig) -> None:
    """Let the faults come in their time; ValueError if there is none, or it cannot be like this."""
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
    """Return what a line is like, and the line if its device does not make it."""
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
    wire: WirePlan, devices: Iterable[DevicePlan], seed: int, stores: dict[Path, StoreFile]
) -> BusMount:
    mount = BusMount(wire.name, wire.bit_rate or BIT_RATE, seed)
    for device in devices:
        mount.add(device.name, *slave_of(device, stores))
    return mount


def slave_of(device: DevicePlan, stores: dict[Path, StoreFile]) -> tuple[CanopenSlave, DeviceEntry]:
    """Return a slave, and what a trace says of it; the files of `stores` are entered there.

    Raises:
        ValueError: its file cannot be read.
        NoNodeIdError: nobody gives it a node-ID.
    """
    kind = Path(device.type) if device.kind is DeviceKind.EDS else device.type
    description = late.describe(eds_cache(), kind, device.profile or AUTO)
    for line in late.finding_lines(description.warnings):
        _logger.warning("%s: %s", device.name, line)
    node_id = description.node_id if device.node_id is None else device.node_id
    if node_id is None:
        raise NoNodeIdError(f"{device.name}: {device.type} gives no node-ID: add node_id = 1..127")
    slave: CanopenSlave | None = device.made.take(device.made_of())
    if slave is None:
        dictionary, memory = description.make_dictionary(), None
        if device.store:
            if device.store not in stores:
                stores[device.store] = StoreFile(device.store)
            memory = stores[device.store].nonvolatile(device.name, dictionary)
        slave = late.make_slave(dictionary, node_id, memory, description.application, device.sdo)
    profile, files = device.profile or AUTO, description.files
    return slave, node_entry(device.wire, slave, kind, profile, files)


# The rig of a bench, with all that a rig file says of it.

NAME = "bench"


def rig_of(
    parts: Parts,
    plan: RigPlan,
    outside: OutsideEnds | None = None,
    *,
    trace: Path | None = None,
    keeps: bool = True,
) -> BenchRig:
    """Make a rig.

    Args:
        parts: the devices on their wires.
        plan: what else is said of them: faults, and where nodes keep what they store.
        outside: where hosts are; without it time is virtual.
        trace: the file in which the run is recorded.
        keeps: whether the run is kept in memory, if it is not in a file.

    Raises:
        ValueError: an input, signal or fault that cannot be.
        OSError: the file of the trace cannot be opened.
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
    rig = BenchRig(NAME, state)
    _begin_faults(plan, rig)
    return rig
