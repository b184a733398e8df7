"""The CANopen slave, side by side with python-canopen's LocalNode and durand."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from pathlib import Path
from time import process_time

from benchmarks.canopen_peers import NODE_ID, PEERS, REPLY, REQUEST, Peer, our_slave
from benchmarks.table import RUNS, rates, row
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.eds import EdsCache
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription

UPLOAD = bytes.fromhex("4002200000000000")
CALLS = 20_000
TIME_OUT_US = 500_000
DOMAIN_BYTES = 20_000
CYCLES = 50
"""In a second of the networks."""
RW = Access.READ | Access.WRITE
EDS = Path(__file__).parents[2] / "tests" / "golden" / "canopen" / "r1.eds"


def run(seconds: float) -> None:
    """Print the rows of this suite."""
    del seconds
    for name, make in PEERS.items():
        expedited(name, make())
    over_a_wire()
    for name, make in PEERS.items():
        segmented(name, make)
    block_download()
    sync_to_tpdo()
    construction()
    network()
    network(buses=8)


def expedited(name: str, ask: Peer) -> None:
    """Upload four bytes again and again, in process."""
    assert ask(UPLOAD)[0][:4] == bytes.fromhex("43022000"), name

    def work() -> None:
        for _ in range(CALLS):
            ask(UPLOAD)

    rates(f"{name}: expedited uploads in process", CALLS, "/s", work)


def over_a_wire() -> None:
    """The same through a rig and a wire at 1 Mbit/s, one thread; the host waits as a link does."""
    wire = CanWire()
    slave = make_slave(small_dictionary(), NODE_ID)
    rig, end = Rig(Station(slave, wire.end())), wire.end(accepts=frozenset({REPLY}))
    rig.run_for(10_000)
    request = (CanFrame(REQUEST, UPLOAD),)

    def work() -> None:
        for _ in range(CALLS // 4):
            now_us = rig.now_us
            end.send(now_us, request)
            rig.run_to(now_us + TIME_OUT_US, end)
            assert end.poll(rig.now_us)

    rates("tickrig: expedited uploads over rig and wire", CALLS // 4, "/s", work)


def small_dictionary() -> Dictionary:
    """Return a dictionary with an SDO server and one number."""
    return Dictionary(
        [
            EntryDescription(0x1000, 0, "Device type", DataType.UNSIGNED32, Access.READ),
            EntryDescription(0x1200, 0, "n", DataType.UNSIGNED8, Access.READ, default=2),
            EntryDescription(
                0x1200, 1, "c2s", DataType.UNSIGNED32, Access.READ, default=0x600, relative=True
            ),
            EntryDescription(
                0x1200, 2, "s2c", DataType.UNSIGNED32, Access.READ, default=0x580, relative=True
            ),
            EntryDescription(0x2002, 0, "u32", DataType.UNSIGNED32, RW),
        ]
    )


def segmented(name: str, make: Callable[[], Peer]) -> None:
    """Download a domain in segments of seven bytes, in process."""
    ask, data = make(), bytes(range(256)) * (DOMAIN_BYTES // 256)
    segments = [data[at : at + 7] for at in range(0, len(data), 7)]
    last = len(segments) - 1
    requests = [
        bytes([(n & 1) << 4 | (7 - len(part)) << 1 | (n == last)]) + part.ljust(7, b"\0")
        for n, part in enumerate(segments)
    ]
    initiate = bytes.fromhex("21082000") + len(data).to_bytes(4, "little")

    def work() -> None:
        ask(initiate)
        for request in requests:
            answer = ask(request)
        assert answer[0][0] & 0xE0 == 0x20, name

    rates(f"{name}: segmented download", len(data) / 1_000, "kB/s", work)


def block_download() -> None:
    """Download a domain in blocks of 127 segments, without CRC, in process."""
    ask, data = our_slave(), bytes(range(256)) * (DOMAIN_BYTES // 256)
    segments = [data[at : at + 7] for at in range(0, len(data), 7)]
    initiate = bytes.fromhex("C2082000") + len(data).to_bytes(4, "little")
    requests = [
        bytes([n % 127 + 1 | (0x80 if n == len(segments) - 1 else 0)]) + part.ljust(7, b"\0")
        for n, part in enumerate(segments)
    ]
    end = bytes([0xC1 | (7 - len(segments[-1])) << 2]) + bytes(7)

    def work() -> None:
        assert ask(initiate)[0][4] == 127
        for request in requests:
            ask(request)
        assert ask(end) == [bytes.fromhex("A100000000000000")]

    rates("tickrig: block download", len(data) / 1_000, "kB/s", work)


def construction() -> None:
    """Make slaves from an EDS that was read before, in processor time; weigh them."""
    cache = EdsCache()

    def make() -> CanopenSlave:
        return make_slave(cache.read(EDS).make_dictionary(), NODE_ID)

    make()
    count, paces = 500, []
    for _ in range(RUNS):
        begun_s = process_time()
        for _ in range(count):
            make()
        paces.append(count / (process_time() - begun_s))
    row("a slave from a cached EDS, processor time", paces, "slaves/s")
    tracemalloc.start()
    kept = [make() for _ in range(count)]
    row("memory of a slave", [tracemalloc.get_traced_memory()[0] / len(kept) / 1_024], "KiB")
    tracemalloc.stop()


def network(buses: int = 1) -> None:
    """Run 127 slaves a bus: heartbeats each 100 ms, SYNC each 20 ms with a TPDO of 8 bytes each."""
    wires, count = [CanWire() for _ in range(buses)], [0]

    def hear(at_us: int, heard: object) -> None:
        count[0] += 1

    slaves = [make_slave(tpdo_dictionary(n == 1), n) for _ in wires for n in range(1, 128)]
    ends = [wire.end() for wire in wires for _ in range(127)]
    rig = Rig(*map(Station, slaves, ends))
    masters = [wire.end(accepts=frozenset()) for wire in wires]
    rig.run_for(100_000)
    for master in masters:
        master.send(rig.now_us, (CanFrame(0, b"\x01\x00"),))
    rig.run_for(1_000_000)

    def work(cycles: int = CYCLES // buses) -> None:
        for _ in range(cycles):
            change(slaves)
            rig.run_for(20_000)

    for wire in wires:
        wire.observers.append(hear)
    work(CYCLES)
    for wire in wires:
        wire.observers.clear()
    load = wires[0].load_permille() / 10
    where = f" on {buses} buses" if buses > 1 else ""
    what = f"{len(slaves)} slaves{where}, {count[0]} frames/s, {load} % load"
    rates(what, CYCLES // buses / CYCLES, "x real time", work)


def sync_to_tpdo() -> None:
    """Let SYNC fetch a TPDO of eight bytes, in process."""
    slave, sync = make_slave(tpdo_dictionary(produces_sync=False), NODE_ID), (CanFrame(0x80),)
    slave.tick(1_000, ())
    slave.dictionary[0x1017, 0].assign(bytes(2))
    slave.tick(2_000, (CanFrame(0, b"\x01\x00"),))
    now_us = 2_000

    def work() -> None:
        nonlocal now_us
        for _ in range(CALLS):
            now_us += 1_000
            sent = slave.tick(now_us, sync)
        assert [frame.can_id for frame in sent] == [0x180 + NODE_ID]

    rates("SYNC in, TPDO out, in process", CALLS, "/s", work)


def change(slaves: list[CanopenSlave]) -> None:
    """Let each application write a new value."""
    for slave in slaves:
        entry = slave.dictionary[0x2003, 0]
        entry.assign((entry.number * 6_364_136_223 + 1 & (1 << 64) - 1).to_bytes(8, "little"))


def tpdo_dictionary(produces_sync: bool) -> Dictionary:
    """Return the objects of a slave with heartbeat and one synchronous TPDO of 8 bytes."""
    u8, u16, u32 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32
    tpdo = Access.READ | Access.WRITE | Access.TPDO
    return Dictionary(
        [
            *small_dictionary().description,
            EntryDescription(0x1005, 0, "SYNC", u32, RW, default=0x80 | produces_sync << 30),
            EntryDescription(0x1006, 0, "Cycle", u32, RW, default=20_000 if produces_sync else 0),
            EntryDescription(0x1017, 0, "Heartbeat", u16, RW, default=100),
            EntryDescription(0x1800, 0, "n", u8, Access.READ, default=2),
            EntryDescription(0x1800, 1, "COB-ID", u32, RW, default=0x4000_0180, relative=True),
            EntryDescription(0x1800, 2, "Type", u8, RW, default=1),
            EntryDescription(0x1A00, 0, "n", u8, RW, default=1),
            EntryDescription(0x1A00, 1, "map", u32, RW, default=0x2003_0040),
            EntryDescription(0x2003, 0, "u64", DataType.UNSIGNED64, tpdo, default=1),
        ]
    )
