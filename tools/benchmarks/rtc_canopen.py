"""DeviceRTCs on a rig; the RTC-CANopen server: proxies at 100 Hz, PDO to port, time a frame."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from benchmarks.table import RUNS, percentiles, rates, row, seconds
from tickrig.device.canopen.device_rtc import CanopenComponent, make_device_rtc
from tickrig.device.canopen.device_rtc import CanopenOutPort as DeviceOutPort
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.links.link import StampedFrames
from tickrig.host.rtc import InPort, ModuleSpec, OutPort, RtComponent
from tickrig.host.rtc.canopen.definition import NodeEntry, Role, SystemDefinition, read_device_file
from tickrig.host.rtc.canopen.pdo_layout import PdoLayout, lay_out
from tickrig.host.rtc.canopen.served_node import NodePhase
from tickrig.host.rtc.canopen.server import RtcCanopenServer
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.canopen.pdo import MappedObject
from tickrig.wire.rtc_canopen import LONG
from tickrig.wire.rtc_types.rtc import TimedOctet, TimedShortSeq

EDS = Path(__file__).parents[2] / "examples" / "eds" / "f-palette.eds"
NODES = 126
DEVICES = 32
SECONDS = 5
PERIOD_US = 10_000
FRAMES = 20_000
CALLS = 5_000


class Counter(CanopenComponent):
    """Writes its port in each period."""

    type_name = "Counter"
    count = DeviceOutPort("count", LONG)
    periods = 0

    def on_execute(self) -> None:
        """Count."""
        self.periods += 1
        self.count.write(self.periods)


class Sink(RtComponent):
    """Has a port for the analogue inputs of a palette, and one for its outputs."""

    spec = ModuleSpec("Sink")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.in_ = self.add_port(InPort[Any]("in", TimedShortSeq))
        self.out = self.add_port(OutPort[Any]("out", TimedOctet))


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    del seconds
    devices()
    periods()
    frames()
    latency()


def devices() -> None:
    """Run DeviceRTCs that each execute and send a PDO in each period of 10 ms."""
    wire, sent = CanWire(), [0]

    def hear(at_us: int, heard: object) -> None:
        sent[0] += 1

    wire.observers.append(hear)
    slaves = [make_device_rtc(Counter, node_id) for node_id in range(1, DEVICES + 1)]
    rig = Rig(*(Station(slave, wire.end()) for slave in slaves))
    master = wire.end(accepts=frozenset())
    rig.run_for(100_000)
    master.send(rig.now_us, (CanFrame(0, b"\x01\x00"),))
    rig.run_for(1_000_000)
    sent[0] = 0

    def work() -> None:
        rig.run_for(1_000_000)

    work()
    load = wire.load_permille() / 10
    what = f"{DEVICES} DeviceRTCs at 100 Hz, a port each, {sent[0]} frames/s, {load} % load"
    rates(what, 1, "x real time", work)


def ready(count: int) -> RtcCanopenServer:
    """Return a server whose nodes are Operational, without a bus."""
    nodes = tuple(NodeEntry(n, f"N{n}", "eds", Role.DEVICE) for n in range(1, count + 1))
    server = RtcCanopenServer(SystemDefinition(nodes), {"eds": read_device_file(EDS)})
    server.tick(0, ())
    for node in server.nodes.values():
        node.dialogue.clear()
        node.layouts, node.phase = layouts(node.entry.id), NodePhase.READY
        server.booted(node)
    for at_us in range(PERIOD_US, 50 * PERIOD_US, PERIOD_US):
        alive = at_us % (10 * PERIOD_US) == 0
        server.tick(
            at_us, stamped(at_us, heartbeats(server, NmtState.OPERATIONAL) if alive else ())
        )
    assert all(node.proxy and node.proxy.confirmed for node in server.nodes.values())
    return server


def layouts(node_id: int) -> tuple[PdoLayout, ...]:
    """Return a TPDO with four analogue inputs, and an RPDO with eight digital outputs."""
    outputs = (MappedObject(0x6200, 1, 8),)
    mapping = tuple(MappedObject(0x6401, sub, 16) for sub in range(1, 5))
    types: dict[tuple[int, int], int] = {(0x6401, sub): DataType.INTEGER16 for sub in range(1, 5)}
    return (
        lay_out(0x1801, 0x280 + node_id, mapping, types),
        lay_out(0x1400, 0x200 + node_id, outputs, {(0x6200, 1): DataType.UNSIGNED8}),
    )


def heartbeats(server: RtcCanopenServer, state: NmtState) -> Frames:
    """Return a heartbeat of each node."""
    return tuple(CanFrame(0x700 + node_id, bytes((state,))) for node_id in server.nodes)


def stamped(at_us: int, frames: Frames) -> StampedFrames:
    """Return frames of one time."""
    return tuple((at_us, frame) for frame in frames)


def periods() -> None:
    """Run proxies that each receive a PDO in each period of 10 ms."""
    server = ready(NODES)
    sink_all(server)
    pdos = tuple(CanFrame(0x280 + node_id, bytes(8)) for node_id in server.nodes)
    alive = heartbeats(server, NmtState.OPERATIONAL)
    values = []
    for _ in range(RUNS):
        start, begin_us = time.process_time(), server.now_us
        for period in range(1, SECONDS * 100 + 1):
            heard = (*pdos, *alive) if period % 10 == 0 else pdos
            at_us = begin_us + period * PERIOD_US
            server.tick(at_us, stamped(at_us, heard))
        values.append(NODES * SECONDS / (time.process_time() - start))
    row("proxies at 100 Hz that one core serves, a PDO and a port write each period", values, "")


def sink_all(server: RtcCanopenServer) -> None:
    """Connect the ports of each proxy."""
    for node in server.nodes.values():
        sink = server.manager.add(Sink(f"S{node.entry.id}"), rate_hz=1.0)
        server.manager.connect(f"{node.entry.name}.tpdo2", f"{sink.instance_name}.in")
        server.manager.connect(f"{sink.instance_name}.out", f"{node.entry.name}.rpdo1")


def frames() -> None:
    """Give the server frames one by one, as a bus does."""
    server = ready(NODES)
    sink_all(server)
    pdos = [CanFrame(0x280 + 1 + n % NODES, bytes(8)) for n in range(FRAMES)]
    strangers = [CanFrame(0x4FF, bytes(8))] * FRAMES
    for what, traffic in (("PDO to a port", pdos), ("a frame without a receiver", strangers)):

        def work(traffic: list[CanFrame] = traffic) -> None:
            for frame in traffic:
                server.tick(server.now_us, ((server.now_us, frame),))

        taken_us = [seconds(work)[0] / FRAMES * 1e6 for _ in range(RUNS)]
        row(f"{what}, {NODES} proxies, one frame a tick", taken_us, "us")


def latency() -> None:
    """Time from a received PDO to the value at the InPort of another component."""
    server = ready(NODES)
    sink_all(server)
    port = server.manager.port("S1.in")
    assert isinstance(port, InPort)
    values = []
    for n in range(CALLS):
        frame = CanFrame(0x281, n.to_bytes(8, "little"))
        start = time.perf_counter()
        server.tick(server.now_us, ((server.now_us, frame),))
        assert port.is_new
        values.append(1e6 * (time.perf_counter() - start))
        port.read()
    percentiles("PDO to InPort of another component", values, "us")
