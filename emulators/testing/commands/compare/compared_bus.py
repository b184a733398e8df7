"""What nodes on a CAN bus said, and what emulated nodes say to the same master."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Final

from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.node.node import Node
from tickrig.emulators.record.bench_replay import BenchRecording, do, play_device, traffic_of
from tickrig.emulators.record.comparison import Said
from tickrig.emulators.record.tolerance import Tolerance
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.testing.commands.compare.compared_line import (
    SEARCHED_US,
    ComparedRun,
    begin_with,
    closest,
)
from tickrig.host.text.bench_record import BenchRecord
from tickrig.host.text.trace import Mark
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorFrame

ALWAYS: Final = (0x080, 0x580, 0x700)
"""CAN-IDs that a node has without an object: EMCY, answers of its SDO server, heartbeat."""

EMCY: Final = (0x1014, 0)
SDO_SERVERS: Final = range(0x1200, 0x1280)
TPDOS: Final = range(0x1800, 0x1A00)
UNUSED: Final = 1 << 31
CAN_ID: Final = 0x1FFF_FFFF


def compare_node_ticks(recording: BenchRecording, name: str, node: Node) -> ComparedRun:
    """Feed a node tick by tick, as the recorded one was.

    Args:
        recording: recorded at the device.
        name: of the node.
        node: a fresh one.
    """
    recorded = [
        Said(at_us, str(frame), line)
        for at_us, frames, line in traffic_of(recording.of(name), Mark.FROM_DEVICE)
        for frame in frames
    ]
    emulated = [
        Said(at_us, str(frame))
        for at_us, frames in play_device(recording, name, node)
        for frame in frames
    ]
    return ComparedRun(recorded, emulated)


def compare_bus(
    recording: BenchRecording,
    make: Callable[[CanWire], Sequence[Node]],
    tolerance: Tolerance,
    settle_us: int,
    bit_rate: int,
) -> ComparedRun:
    """Put the recorded frames of all others on a bus with emulated nodes, at their times.

    What a node sends is known by its CAN-IDs, as its dictionary has them at that time.

    Args:
        recording: recorded at a port of the bus.
        make: makes the nodes on a bus.
        tolerance: how long after the end they may still answer.
        settle_us: how long the nodes have been on when the recording begins. If what was said
            first is what one of them says by itself when it is switched on, that is tried too,
            and the closer one counts.
        bit_rate: of the bus in bit/s.
    """
    records = [x for x in recording.records if isinstance(x.traffic, CanFrame) or x.text]
    until_us = recording.until_us + tolerance.allowed_us(recording.until_us)

    def run(begin_us: int) -> ComparedRun:
        bus = _Bus(make, bit_rate, begin_us)
        emulated = bus.play(records, begin_us + until_us)
        return ComparedRun(bus.recorded, [x for x in emulated if x.at_us >= -tolerance.time_us])

    settled = run(settle_us)
    begins = []
    if settled.recorded:
        alone = _Bus(make, bit_rate, 0).play((), SEARCHED_US)
        begins = begin_with(settled.recorded[0], alone, tolerance)
    return closest([settled, *map(run, begins)], recording.until_us, tolerance)


class _Bus:
    """Emulated nodes, and all others as they were recorded."""

    def __init__(
        self, make: Callable[[CanWire], Sequence[Node]], bit_rate: int, begin_us: int
    ) -> None:
        self._wire, self._begin_us = CanWire(bit_rate), begin_us
        self._nodes = {node.name: node for node in make(self._wire)}
        self._rig = Rig(*(Station(node, node.port) for node in self._nodes.values()))
        self._host = self._wire.end(frozenset())
        self._host.auto_recovery = True
        self._wire.end(frozenset())  # one that acknowledges what the host sends
        self._ids = {name: _Produced(node.slave) for name, node in self._nodes.items()}
        self._wire.observers.append(self._hear)
        self.recorded: list[Said] = []
        self._said: list[Said] = []

    def play(self, records: Iterable[BenchRecord], end_us: int) -> list[Said]:
        """Return what the nodes say up to a time, from the begin of the recording."""
        for number, record in enumerate(records):
            at_us = max(0, self._begin_us + record.at_us)
            early = self._begin_us + record.at_us < 0
            self._rig.event_queue.put(number, at_us, partial(self._act, record, early))
        self._rig.run_to(end_us)
        return self._said

    def owns(self, traffic: object) -> bool:
        """Say whether an emulated node sends such a frame."""
        return isinstance(traffic, CanFrame) and any(x.has(traffic) for x in self._ids.values())

    def _act(self, record: BenchRecord, early: bool, now_us: int) -> None:
        """Do what the host or a hand did; `early` is before the nodes were switched on."""
        frame = record.traffic
        if not isinstance(frame, CanFrame):
            self._do(record)
        elif record.mark is Mark.FROM_DEVICE and self.owns(frame):
            self.recorded.append(Said(record.at_us, str(frame), record.line))
        elif not early:
            self._host.send(now_us, (frame,))

    def _do(self, record: BenchRecord) -> None:
        """Do what was done to a node by hand: `5/power_off=1`, or to the only one."""
        prefix, slash, text = record.text.partition("/")
        node = self._nodes.get(prefix) if slash else next(iter(self._nodes.values()))
        if node is None:
            raise ValueError(f"line {record.line}: no node {prefix!r:.60}")
        do(node, record._replace(text=text if slash else record.text))

    def _hear(self, at_us: int, passed: CanFrame | ErrorFrame) -> None:
        if self.owns(passed):
            self._said.append(Said(at_us - self._begin_us, str(passed)))


class _Produced:
    """Which frames a slave sends."""

    def __init__(self, slave: CanopenSlave) -> None:
        self._slave = slave
        wanted = [EMCY, *((x, 2) for x in SDO_SERVERS), *((x, 1) for x in TPDOS)]
        found = [slave.dictionary.find(*each) for each in wanted]
        self._entries = [entry for entry in found if entry is not None]

    def has(self, frame: CanFrame) -> bool:
        if frame.can_id - self._slave.node_id in ALWAYS:
            return not frame.remote
        numbers = (entry.number for entry in self._entries)
        return not frame.remote and any(
            number & CAN_ID == frame.can_id and not number & UNUSED for number in numbers
        )
