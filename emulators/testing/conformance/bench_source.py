"""A node on a bench in virtual time, as a source for the tester."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final

from tickrig.device.canopen.dictionary import SdoAbort
from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.ds402 import Ds402
from tickrig.device.canopen.slave import Application, CanopenSlave
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.rig.sim_waits import HostLimit
from tickrig.emulators.testing.bench.bench import Bench, BenchDevice
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.modes.mode import BenchMode
from tickrig.emulators.testing.bench.modes.virtual_mode import VirtualMode
from tickrig.emulators.testing.bench.mounts import BusMount
from tickrig.emulators.testing.conformance.slave import Crashes, guarded
from tickrig.emulators.testing.rig_file.plan import DeviceKind, RigPlan
from tickrig.emulators.testing.rig_file.reader import read_rig_file
from tickrig.host.canmon.conform.conform_source import ConformSource
from tickrig.host.canopen.conform.binding.capabilities import NodeDescription
from tickrig.host.canopen.conform.bus.exchange import NotAllowed
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.host.canopen.eds import open_eds
from tickrig.wire.errors import FieldError

# Stimuli of the tester for our slaves, set from the inside.

_LINES: Final = 8
"""Number of lines per group: `di1` has lines 1 to 8, and `di2` the next 8 lines."""

_ANALOGUE: Final = 0x6401
_INPUTS: Final = {0x6000: "di", _ANALOGUE: "ai"}
"""Objects of CiA 401 that show the inputs."""


class SlaveStimulus:
    """Operates an emulated slave for the conformance tester: sets its inputs, reads its outputs.

    Args:
        slave: the slave. Its supply is switched elsewhere.
    """

    def __init__(self, slave: CanopenSlave) -> None:
        self._slave, self._application = slave, Application.of(slave)

    def __call__(self, *words: str) -> str:
        """Execute a stimulus, and return the read value; raise NotAllowed if not supported."""
        slave, application = self._slave, self._application
        match words:
            case ("input", name, data) if ":" in name:
                self._assign(name, bytes.fromhex(data))
            case ("output", "time"):
                time = slave.time_of_day
                return "none" if time is None else f"{time.ms}.{time.days}"
            case ("emergency", code, register):
                slave.emergency(int(code, 16), int(register, 16))
            case ("emergency-clear", code):
                slave.emergency_clear(int(code, 16))
            case ("node-id", node_id):
                slave.configured_id = int(node_id, 16)
            case ("fault", code) if isinstance(application, Ds402):
                application.fault(int(code, 16))
            case _ if isinstance(application, Ds401):
                return _module(application, words)
            case _:
                raise _unknown(words)
        return ""

    def _assign(self, name: str, data: bytes) -> None:
        """Write an object from inside the device; for an input object, set the inputs."""
        index, sub = (int(part, 16) for part in name.split(":"))
        if isinstance(self._application, Ds401) and index in _INPUTS:
            value = int.from_bytes(data, "little", signed=index == _ANALOGUE)
            text = f"{value}" if index == _ANALOGUE else f"{value:02X}"
            _module(self._application, ("input", f"{_INPUTS[index]}{sub}", text))
            return
        entry = self._slave.dictionary.find(index, sub)
        if entry is None:
            raise NotAllowed(f"input {name}: the device has no such object")
        try:
            entry.data_type.decode(data)
            entry.assign(data)
        except (FieldError, SdoAbort) as error:
            raise NotAllowed(f"input {name} {data.hex().upper()}: {error}") from None


def _module(module: Ds401, words: tuple[str, ...]) -> str:
    """Set lines (eight at once, in hex) and channels (in counts) of a CiA 401 module."""
    try:
        match words[0], words[1][:2], int(words[1][2:]), words[2:]:
            case "input", "di", number, (data,):
                for bit in range(_LINES):
                    line = _LINES * (number - 1) + bit + 1
                    module.inputs.set(f"di{line}", int(data, 16) >> bit & 1)
            case "input", "ai", number, (data,):
                _set_counts(module, number, int(data))
            case "output", "do", number, ():
                return f"{int(module.read('do')) >> _LINES * (number - 1) & 0xFF:02X}"
            case "output", "ao", number, ():
                return str(module.read(f"ao{number}"))
            case _:
                raise _unknown(words)
    except (ValueError, KeyError) as error:
        raise NotAllowed(f"{' '.join(words)}: {error}") from None
    return ""


def _set_counts(module: Ds401, number: int, counts: int) -> None:
    """Set an analogue input to the value that its converter turns into these counts."""
    found = (each.channel for each in module.analogue_inputs if each.number == number)
    channel = next(found, None)
    if channel is None:
        raise ValueError(f"there is no analogue input {number}")
    converter = channel.converter
    value = converter.quantity(counts) if converter else counts
    if converter and converter.counts(value) != counts:
        raise ValueError(f"the converter of {channel.name} has no step of {counts} counts")
    module.inputs.set(channel.name, value)


def _unknown(words: tuple[str, ...]) -> NotAllowed:
    return NotAllowed(f"{' '.join(words)}: the device has nothing of the kind")


# Stimuli for a device on a bench.


class _BenchStimulus:
    """Stimuli of a device of a bench in virtual time.

    Args:
        device: a CANopen node.
        slave: slave of the CANopen node.
    """

    def __init__(self, device: BenchDevice, slave: CanopenSlave) -> None:
        self._device, self._inside = device, SlaveStimulus(slave)

    def __call__(self, *words: str) -> str:
        """Execute a stimulus, and return the read value."""
        match words:
            case ("power", "on"):
                self._device.switch_on()
            case ("power", "off"):
                self._device.switch_off()
            case _:
                return self._inside(*words)
        return ""


_BOOT_US = 100_000
"""Time after which all nodes have booted."""

_Buses = dict[str, dict[str, CanopenSlave]]
"""The slaves by name, for each CAN bus."""


def bench_source(
    mode: BenchMode, node_id: int | None = None, name: str = "", device: str = ""
) -> ConformSource:
    """Return the CANopen nodes of a bench as a source of nodes for the conformance tester.

    The nodes boot first, which takes time on the bench.

    Args:
        mode: the mode of the bench, in virtual time.
        node_id: node-ID of a node on the wanted bus, or None for the bus of the first node.
        name: name of the bench for messages.
        device: name of the device whose bus is used, or empty for any.

    Raises:
        ValueError: the bench is not in virtual time, no CANopen node has the node-ID, or nodes on
            different buses have it. The same error is raised if `device` is not a CANopen node.
    """
    if not isinstance(mode, VirtualMode):
        raise ValueError("the bench is not in virtual time: canmon conform judges what is there")
    mode.run_for(_BOOT_US)
    buses = {bus: on for bus, on in mode.act(_slaves).items() if not device or device in on}
    if device and not buses:
        raise ValueError(f"{device} is no CANopen node")
    bus = _bus_of(buses, node_id, name or (device and f"the bus of {device}") or "the bench")
    slaves = buses[bus]
    names = {slave.node_id: each for each, slave in slaves.items()}
    crashes = mode.act(lambda rig: _watch_nodes(_mount(rig, bus)))
    limit = mode.act(lambda rig: _limit_hosts(rig, HostLimit()))  # each check ends by itself
    return ConformSource(
        mode.act(lambda rig: CanHost(rig.rig, _mount(rig, bus).open_end())),
        name or bus,
        "a rig in virtual time",
        mode.act(lambda rig: _mount(rig, bus).wire.bit_rate),
        virtual=True,
        nodes=dict(sorted(names.items())),
        eds={number: f"{each}.eds" for number, each in names.items()},
        describe=lambda number: describe_slave(slaves[names[number]]) if number in names else None,
        stimulus=lambda number: guarded(
            _BenchStimulus(BenchDevice(mode, names[number]), slaves[names[number]])
        ),
        close=lambda: mode.act(lambda rig: _end(rig, bus, limit)),
        watch=lambda number, run: _watch(crashes, names[number], run),
    )


def _bus_of(buses: _Buses, node_id: int | None, name: str) -> str:
    """Return the bus of a node; by default the bus of the node with the lowest node-ID."""
    nodes = sorted((slave.node_id, bus) for bus, on in buses.items() for slave in on.values())
    if not nodes:
        raise ValueError(f"{name} has no CANopen node")
    found = dict.fromkeys(bus for number, bus in nodes if node_id in (None, number))
    if not found:
        known = ", ".join(str(number) for number, _ in nodes)
        raise ValueError(f"{name} has no node {node_id}; its nodes: {known}")
    if node_id is not None and len(found) > 1:
        raise ValueError(f"{name} has a node {node_id} on each of {', '.join(found)}: leave one")
    return next(iter(found))


def describe_slave(slave: CanopenSlave) -> NodeDescription:
    """Return the EDS of a slave of tickrig."""
    description = slave.dictionary.description
    return NodeDescription.of_table(description, description.objects)


def _slaves(rig: BenchRig) -> _Buses:
    """Return the slaves by name, for each CAN bus."""
    return {
        mount.name: {name: node.slave for name, node in mount.nodes.items()}
        for mount in rig.state.mounts.values()
        if isinstance(mount, BusMount)
    }


def _watch_nodes(mount: BusMount) -> dict[str, Crashes]:
    """Keep the bench running if programs of slaves raise exceptions."""
    crashes = {name: Crashes(name) for name in mount.nodes}
    for name, node in mount.nodes.items():
        node.on_crash = crashes[name]
    return crashes


def _limit_hosts(rig: BenchRig, limit: HostLimit) -> HostLimit:
    """Start a limit on the waits of hosts; return the previous one."""
    before, rig.rig.host_limit = rig.rig.host_limit, limit
    limit.restart(rig.rig.now_us)
    return before


def _end(rig: BenchRig, bus: str, limit: HostLimit) -> None:
    """Stop watching the nodes, and restore the limit on the waits of hosts."""
    for node in _mount(rig, bus).nodes.values():
        node.on_crash = None
    _limit_hosts(rig, limit)


def _watch(crashes: dict[str, Crashes], name: str, run: ConformRun) -> None:
    """Count a crash of the node under test as a failure; report a crash of another node."""
    for each, crash in crashes.items():
        crash.watch(run.crash if each == name else lambda reason, where: run.disturb(reason))


def _mount(rig: BenchRig, bus: str) -> BusMount:
    mount = rig.state.mounts[bus]
    assert isinstance(mount, BusMount)
    return mount


# Rig files as sources of `canmon conform`: in virtual time, without a bus outside.


def open_rig(path: Path, node_id: int | None = None) -> ConformSource:
    """Open a rig file in virtual time for the conformance tester, without its real-time settings.

    Args:
        path: path of the rig file.
        node_id: node-ID of a node on the wanted bus, or None for the bus of the first node.

    Raises:
        OSError: the file cannot be read.
        ValueError: the file has errors, a device cannot be made, or no node has this node-ID.
    """
    plan = read_rig_file(path)
    bench = Bench.of_plan(plan)
    source = bench_source(bench._mode, node_id, str(path))
    files = dict(_eds_files(plan, source.nodes))

    def describe(number: int) -> NodeDescription | None:
        if number in files:
            return NodeDescription.of_file(open_eds(files[number]))
        return source.describe(number)

    eds = source.eds | {number: str(file) for number, file in files.items()}
    return replace(source, eds=eds, describe=describe, close=bench.close)


def _eds_files(plan: RigPlan, nodes: dict[int, str]) -> Iterator[tuple[int, Path]]:
    """Yield the EDS files of the nodes; the tester checks these files too."""
    for node_id, name in nodes.items():
        device = plan.devices[name]
        if device.kind is DeviceKind.EDS:
            yield node_id, Path(device.type)
