"""A node on a bench in virtual time, as the tester finds it."""

from __future__ import annotations

from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.testing.bench.bench_device import BenchDevice
from tickrig.emulators.testing.bench.bench_rig import BenchRig
from tickrig.emulators.testing.bench.modes.mode import BenchMode
from tickrig.emulators.testing.bench.modes.virtual_mode import VirtualMode
from tickrig.emulators.testing.bench.mounts import BusMount
from tickrig.emulators.testing.conformance.bench_stimulus import BenchStimulus
from tickrig.emulators.testing.conformance.crash import Crashes, guarded
from tickrig.host.canmon.conform.conform_source import ConformSource
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.eds_writer import write_eds

BOOT_US = 100_000
"""All nodes have booted by then."""

Buses = dict[str, dict[str, CanopenSlave]]
"""The slaves on each CAN bus, by their names."""


def bench_source(
    mode: BenchMode, node_id: int | None = None, name: str = "", device: str = ""
) -> ConformSource:
    """Return where the nodes of a bench are; some time passes on it.

    Args:
        mode: of the bench; its time is virtual.
        node_id: of the node whose bus it is; that of the first node if nobody says it.
        name: of the bench, for people.
        device: of which the bus is wanted, by its name; empty for any.

    Raises:
        ValueError: it is in another mode, has no CANopen node, none of this node-ID, or some on
            several buses; or the device is none.
    """
    if not isinstance(mode, VirtualMode):
        raise ValueError("the bench is not in virtual time: canmon conform judges what is there")
    mode.run_for(BOOT_US)
    buses = {bus: on for bus, on in mode.act(_slaves).items() if not device or device in on}
    if device and not buses:
        raise ValueError(f"{device} is no CANopen node")
    bus = _bus_of(buses, node_id, name or (device and f"the bus of {device}") or "the bench")
    slaves = buses[bus]
    names = {slave.node_id: each for each, slave in slaves.items()}
    crashes = mode.act(lambda rig: _watch_nodes(_mount(rig, bus)))
    return ConformSource(
        mode.act(lambda rig: CanHost(rig.rig, _mount(rig, bus).open_end())),
        name or bus,
        "a rig in virtual time",
        mode.act(lambda rig: _mount(rig, bus).wire.bit_rate),
        virtual=True,
        nodes=dict(sorted(names.items())),
        eds={slave.node_id: eds_of(slave, f"{each}.eds") for each, slave in slaves.items()},
        stimulus=lambda number: guarded(
            BenchStimulus(BenchDevice(mode, names[number]), slaves[names[number]])
        ),
        close=lambda: mode.act(lambda rig: _watch_no_more(_mount(rig, bus))),
        watch=lambda number, run: _watch(crashes, names[number], run),
    )


def _bus_of(buses: Buses, node_id: int | None, name: str) -> str:
    """Return the bus on which a node is; that of the lowest node-ID if none is given."""
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


def eds_of(slave: CanopenSlave, name: str) -> EdsFile:
    """Return what the EDS of a slave of ours would say."""
    return EdsFile(name, write_eds(slave.dictionary.description))


def _slaves(rig: BenchRig) -> Buses:
    """Return the slaves on each CAN bus, by their names."""
    return {
        mount.name: {name: node.slave for name, node in mount.nodes.items()}
        for mount in rig.state.mounts.values()
        if isinstance(mount, BusMount)
    }


def _watch_nodes(mount: BusMount) -> dict[str, Crashes]:
    """Let what their programs raise be no end of the bench."""
    crashes = {name: Crashes(name) for name in mount.nodes}
    for name, node in mount.nodes.items():
        node.on_crash = crashes[name]
    return crashes


def _watch_no_more(mount: BusMount) -> None:
    for node in mount.nodes.values():
        node.on_crash = None


def _watch(crashes: dict[str, Crashes], name: str, run: ConformRun) -> None:
    """Let a crash be a failure of the node under test; that of another one disturbs."""
    for each, crash in crashes.items():
        crash.watch(run.crash if each == name else lambda reason, where: run.disturb(reason))


def _mount(rig: BenchRig, bus: str) -> BusMount:
    mount = rig.state.mounts[bus]
    assert isinstance(mount, BusMount)
    return mount
