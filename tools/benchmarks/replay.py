"""A trace of four drives in csp, SYNC each 10 ms: read, and replayed device by device."""

from __future__ import annotations

from benchmarks.drives import CYCLE_US, Master, stored
from benchmarks.table import rates
from tickrig.device.canopen.models import epos
from tickrig.device.canopen.slave import Nonvolatile
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.node import Node
from tickrig.emulators.record.recorder import TraceRecorder
from tickrig.emulators.record.replay import read_bench_recording, replay_device
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.testing.bench.recorded_device import node_entry
from tickrig.host.text.bench_header import BenchHeader, WireEntry, WireType

DRIVES = 4
SECONDS = 10


def node(number: int, wire: CanWire) -> Node:
    """Return a drive as the recorded one was made."""
    return Node(f"drive{number}", epos.make_epos(number, Nonvolatile(dict(stored(CYCLE_US)))), wire)


def trace() -> bytes:
    """Return what a recorder writes of a run."""
    wire = CanWire()
    nodes = {f"drive{number}": node(number, wire) for number in range(1, DRIVES + 1)}
    entries = {name: node_entry("can", its.slave, "") for name, its in nodes.items()}
    recorder = TraceRecorder(None, BenchHeader(entries, {"can": WireEntry(WireType.CAN)}))
    master = Station(Master(DRIVES, CYCLE_US), wire.end())
    drives = (Station(recorder.device(name, its), its.port) for name, its in nodes.items())
    rig = Rig(master, *drives)
    rig.run_for(SECONDS * 1_000_000)
    return "".join(f"{line}\n" for line in recorder.lines(rig.now_us)).encode()


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    del seconds
    data = trace()
    recording = read_bench_recording(data)
    rates("trace of four drives, read", SECONDS, "x real time", lambda: read_bench_recording(data))

    def work() -> None:
        for number in range(1, DRIVES + 1):
            made = node(number, CanWire())
            assert replay_device(recording, f"drive{number}", made) is None

    rates("trace of four drives, replayed", SECONDS, "x real time", work)
