"""The CAN wire: 127 nodes as small as can be, so that the wire and the rig are measured."""

from __future__ import annotations

import random

from benchmarks.table import rates
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.can import CanFrame, Frames, frame_bits

NODES = 127
SYNC_US = 20_000
HEARTBEAT_US = 100_000
SECONDS = 2


class Node:
    """Answers SYNC with a TPDO of eight bytes that change, and sends heartbeats."""

    tick_us = 1_000
    accepts = frozenset({0x080})

    def __init__(self, node_id: int) -> None:
        self.can_id, self.count = 0x180 + node_id, node_id
        self.due_us = 1_000 + node_id * 1_000 % HEARTBEAT_US
        self.heartbeat = CanFrame(0x700 + node_id, b"\x05")

    def reset(self) -> None:
        """Nothing to forget."""

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Answer."""
        out: Frames = ()
        if rx:
            self.count = (self.count * 6_364_136_223_846_793_005 + 1) & (1 << 64) - 1
            out = (CanFrame(self.can_id, self.count.to_bytes(8, "little")),)
        if now_us >= self.due_us:
            self.due_us += HEARTBEAT_US
            out += (self.heartbeat,)
        return out


class SyncProducer:
    """Sends SYNC."""

    tick_us = 1_000
    accepts = frozenset[int]()
    due_us = SYNC_US

    def reset(self) -> None:
        """Nothing to forget."""

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Send SYNC when it is due."""
        self.due_us += SYNC_US
        return (CanFrame(0x080),)


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    del seconds
    network()
    lengths()


def network() -> None:
    """Run a network of 127 nodes at 1 Mbit/s."""
    wire, count = CanWire(), [0]

    def hear(at_us: int, heard: object) -> None:
        count[0] += 1

    wire.observers.append(hear)
    stations = [Station(Node(node_id), wire.end(Node.accepts)) for node_id in range(1, NODES + 1)]
    rig = Rig(Station(SyncProducer(), wire.end(SyncProducer.accepts)), *stations)
    rig.run_for(1_000_000)
    count[0] = 0
    rig.run_for(1_000_000)
    what = f"{NODES} trivial nodes, {count[0]} frames/s, {wire.load_permille() / 10} % load"
    rates(what, SECONDS, "x real time", lambda: rig.run_for(SECONDS * 1_000_000))


def lengths() -> None:
    """Count the bits of frames of eight bytes."""
    chance = random.Random(1)
    frames = [CanFrame(0x180 + n % 128, chance.randbytes(8)) for n in range(20_000)]

    def work() -> None:
        for frame in frames:
            frame_bits(frame)

    rates("frame_bits, 8 bytes", len(frames), "frames/s", work)
