"""A node that answers by chance, and a run of the tester against it: `tools/fuzz conform`.

The node has few objects. What an object holds has any length; what it answers comes late, twice,
with the wrong toggle, cut, refused or never, at any step. It never tells a value that it does not
hold: so whoever asks it afterwards knows what was put back.
"""

from __future__ import annotations

from collections.abc import Iterator
from random import Random
from typing import Final

from tickrig.host.canopen.conform.check import (
    Act,
    Check,
    ConformancePlan,
    Count,
    Expect,
    ExpectNone,
    Level,
    Period,
    Wait,
)
from tickrig.host.canopen.conform.conform_run import ConformRun
from tickrig.host.canopen.conform.report.report_json import report_json
from tickrig.host.canopen.conform.report.text import text_report
from tickrig.host.canopen.conform.suite import suite_checks
from tickrig.host.canopen.conform.verdict import Report
from tickrig.host.links.link import StampedFrames
from tickrig.wire.can import CanFrame, Frames, data_frame
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.object_table import RO, RW, DeviceInfo, Element, ObjectTable

NODE_ID: Final = 5
LONGEST_CHECK_MS: Final = 150


def _lasts_ms(check: Check) -> int:
    """Return how long a check waits, beside answers."""
    total_ms = 0
    for step in check.steps:
        match step.action:
            case Wait(ms) | ExpectNone(_, ms) | Count(_, ms):
                total_ms += ms
            case Period(_, ms, times):
                total_ms += ms * times
            case Expect(_, ms) | Act(_, int(ms)):
                total_ms += ms // 2_000 * 1_000
    return total_ms


CHECKS: Final = tuple(
    check.id
    for check in suite_checks()
    if check.group not in {"D4", "IO"} and _lasts_ms(check) <= LONGEST_CHECK_MS
)
"""Short ones: what a check waits for is no conversation."""
LONGEST_US: Final = 400_000_000
ANSWERS_US: Final = (*(200,) * 20, 3_000, 700_000)
SIZES: Final = (0, 1, 2, 3, 4, 5, 7, 8, 14, 40)
KINDS: Final = (DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32, DataType.DOMAIN)
PLAIN: Final = {
    0x1005: DataType.UNSIGNED32,
    0x1006: DataType.UNSIGNED32,
    0x100C: DataType.UNSIGNED16,
    0x1014: DataType.UNSIGNED32,
    0x1015: DataType.UNSIGNED16,
    0x1017: DataType.UNSIGNED16,
    0x1019: DataType.UNSIGNED8,
    0x1F80: DataType.UNSIGNED32,
    0x2000: DataType.UNSIGNED8,
    0x2001: DataType.UNSIGNED16,
}
RECORDS: Final = {
    0x1016: (DataType.UNSIGNED32, DataType.UNSIGNED32),
    0x1018: (DataType.UNSIGNED32,) * 4,
    0x1201: (DataType.UNSIGNED32, DataType.UNSIGNED32),
    0x1400: (DataType.UNSIGNED32, DataType.UNSIGNED8),
    0x1600: (DataType.UNSIGNED32, DataType.UNSIGNED32),
    0x1800: (DataType.UNSIGNED32, DataType.UNSIGNED8, DataType.UNSIGNED16),
    0x1A00: (DataType.UNSIGNED32, DataType.UNSIGNED32),
}
HOLDS: Final = {(0x1400, 1): 0x205, (0x1800, 1): 0x185, (0x1005, 0): 0x80, (0x1014, 0): 0x85}


class FuzzNode:
    """A link to a node that does what chance says; its time passes while somebody waits."""

    def __init__(self, chance: Random, device: EdsDevice) -> None:
        self._chance, self.now_us = chance, 0
        self.wild = chance.choice((0, 0.02, 0.1, 0.1, 0.4))
        self.values = {
            (e.index, e.sub): self._first(e.index, e.sub, e.size) for e in device.entries
        }
        self.writable = {(e.index, e.sub) for e in device.entries if e.writable}
        self.before = dict(self.values)
        self._queue: list[tuple[int, CanFrame]] = []
        self._upload, self._at, self._size, self._toggle = b"", (0, 0), 0, 0
        self._download: bytearray | None = None

    def _first(self, index: int, sub: int, size: int) -> bytes:
        if self._chance.random() < 0.2:
            return self._chance.randbytes(self._chance.choice(SIZES))
        held = HOLDS.get((index, sub), 0 if sub or index < 0x1400 else 2)
        return (held & (1 << 8 * (size or 4)) - 1).to_bytes(size or 4, "little")

    def send(self, traffic: Frames, /) -> None:
        for frame in traffic:
            if frame.can_id == 0x600 + NODE_ID and not frame.extended and len(frame.data) == 8:
                for data in self._served(frame.data):
                    self._say(data)
            elif frame.can_id == 0 and frame.data[:1] in (b"\x81", b"\x82"):
                self._queue_up(self.now_us + 500, data_frame(0x705, b"\0"))

    def _say(self, data: bytes) -> None:
        can_id = 0x580 + NODE_ID
        for each in self._twisted(data):
            at_us = self.now_us + self._chance.choice(ANSWERS_US if self.wild else (200,))
            self._queue_up(at_us, data_frame(can_id, each))

    def _queue_up(self, at_us: int, frame: CanFrame) -> None:
        """Send a frame behind those before it: CAN keeps the order of what a node sends."""
        last_us = self._queue[-1][0] if self._queue else 0
        self._queue.append((max(at_us, last_us), frame))

    def _twisted(self, data: bytes) -> Iterator[bytes]:
        chance = self._chance
        if chance.random() >= self.wild:
            yield data
            return
        abort = (
            b"\x80"
            + data[1:4]
            + chance.choice((0x0800_0000, 0x0601_0002, 0xFFFF_FFFF)).to_bytes(4, "little")
        )
        match chance.randrange(7):
            case 0:
                yield from (data, data)
            case 1:
                yield abort
            case 2:
                yield data[: chance.randrange(8)]
            case 3 if data[0] >> 5 in (0, 1):
                yield bytes([data[0] ^ 0x10]) + data[1:]
            case 4:
                yield chance.choice((0x20, 0xA0, 0xC5, 0xE0)).to_bytes(1, "little") + data[1:]
            case 5 if data[0] >> 5:  # what a segment carries is no lie
                yield data[:1] + chance.randbytes(3) + data[4:]

    def _served(self, data: bytes) -> Iterator[bytes]:
        """Serve a request as a sound server does, but for what it is asked of types."""
        at = int.from_bytes(data[1:3], "little"), data[3]
        head = data[:1], data[1:4]
        match data[0] >> 5:
            case 2:
                yield self._begin_upload(at, data[1:4])
            case 3:
                part, self._upload = self._upload[:7], self._upload[7:]
                yield bytes(
                    [self._toggle | (7 - len(part)) << 1 | (not self._upload)]
                ) + part.ljust(7, b"\0")
                self._toggle ^= 0x10
            case 1:
                yield self._begin_download(at, head[1], data)
            case 0 if self._download is not None:
                self._download += data[1 : 8 - (data[0] >> 1 & 7)]
                if data[0] & 1:
                    self.values[self._at], self._download = bytes(self._download), None
                yield bytes([0x20 | data[0] & 0x10]) + bytes(7)
            case 4:
                self._download = None
            case _:
                yield b"\x80" + data[1:4] + bytes.fromhex("01000405")

    def _begin_upload(self, at: tuple[int, int], multiplexer: bytes) -> bytes:
        value = self.values.get(at)
        if value is None:
            return b"\x80" + multiplexer + bytes.fromhex("00000206")
        if 1 <= len(value) <= 4:
            return bytes([0x43 | (4 - len(value)) << 2]) + multiplexer + value.ljust(4, b"\0")
        self._upload, self._toggle = value, 0
        return b"\x41" + multiplexer + len(value).to_bytes(4, "little")

    def _begin_download(self, at: tuple[int, int], multiplexer: bytes, data: bytes) -> bytes:
        if at not in self.values:
            return b"\x80" + multiplexer + bytes.fromhex("00000206")
        if at not in self.writable or self._chance.random() < self.wild / 4:
            return b"\x80" + multiplexer + bytes.fromhex("02000106")
        if data[0] & 2:
            size = 4 - (data[0] >> 2 & 3) if data[0] & 1 else 4
            self.values[at] = data[4 : 4 + size]
        else:
            self._download, self._at = bytearray(), at
        return b"\x60" + multiplexer + bytes(4)

    def receive(self, timeout_us: int, /) -> Frames:
        return tuple(frame for _, frame in self.receive_stamped(timeout_us)[1])

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        until_us = self.now_us + timeout_us
        self.now_us = (
            max(self.now_us, min(self._queue[0][0], until_us)) if self._queue else until_us
        )
        there = tuple(each for each in self._queue if each[0] <= self.now_us)
        del self._queue[: len(there)]
        return self.now_us, there

    def close(self) -> None:
        """Nothing is held."""


def dictionary(chance: Random) -> EdsDevice:
    """Choose some objects, and of some another type than they should have."""
    table = ObjectTable()
    table.variable(0x1000, "Device type", DataType.UNSIGNED32, RO)
    table.variable(0x1001, "Error register", DataType.UNSIGNED8, RO)
    for index, kind in PLAIN.items():
        if chance.random() < 0.15:
            access = RW if chance.random() < 0.8 else RO
            table.variable(index, "object", _kind(chance, kind), access)
    for index, kinds in RECORDS.items():
        if chance.random() < 0.1:
            rows = [_row(chance, sub, kind) for sub, kind in enumerate(kinds, 1)]
            table.record(index, "record", rows, count_access=RW, count=len(rows))
    return EdsDevice(DeviceInfo(), tuple(table), table.objects)


def _row(chance: Random, sub: int, kind: DataType) -> Element:
    kind = _kind(chance, kind)
    return Element(sub, "entry", kind, RW, b"" if kind is DataType.DOMAIN else 0)


def _kind(chance: Random, kind: DataType) -> DataType:
    return chance.choice(KINDS) if chance.random() < 0.1 else kind


def converse(chance: Random) -> tuple[FuzzNode, Report]:
    """Judge a node of chance by a check or two."""
    device = dictionary(chance)
    node = FuzzNode(chance, device)
    level = chance.choice((Level.COMMUNICATION, Level.INTRUSIVE))
    only = (chance.choice((*CHECKS, "OD-1*-long")),)
    plan = ConformancePlan(
        level, only, confirm=lambda question: True, bit_rate=1_000_000, max_load=1
    )
    known = device if chance.random() < 0.98 else None
    return node, ConformRun(node, NODE_ID, plan, device=known).run()


def unsaid(node: FuzzNode, report: Report) -> list[str]:
    """Return what is not as it was and not in the report."""
    told = " ".join(report.unrestored)
    return [
        f"{at[0]:04X}h:{at[1]:02X} is {value.hex()}, was {node.before[at].hex()}"
        for at, value in node.values.items()
        if value != node.before[at] and f"{at[0]:04X}h:{at[1]:02X}" not in told
    ]


def judge_conversation(chance: Random) -> str:
    """Say in a word how a conversation ended; raises if it left something behind in silence."""
    node, report = converse(chance)
    report_json(report)
    text_report(report)
    left = unsaid(node, report)
    assert not left, left
    assert report.duration_us < LONGEST_US, report.duration_us
    return "unrestored" if report.unrestored else "restored"


def mutated(chance: Random) -> tuple[str, bytes]:
    """Choose the seed of a conversation."""
    return "conversation", chance.randbytes(8)


def judge(_name: str, data: bytes) -> str:
    """Hold a conversation."""
    return judge_conversation(Random(data))
