"""A node whose SDO frames are late, in order, lost or doubled, and whose objects tell the time."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import cycle

from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.canopen.stack import make_slave
from tickrig.host.links.link import StampedFrames, StampedLink
from tickrig.wire.can import CanFrame, Frames
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import RO, RW, Element, ObjectTable
from tickrig.wire.canopen.sdo_frame import REQUEST_COB_ID, RESPONSE_COB_ID
from tickrig.wire.instant import NEVER

NODE_ID = 5
CLOCK, TEXT, TIME = (0x2000, 0), (0x2001, 0), (0x2002, 0)
"""The time in ms: in an expedited answer, in segments, in another expedited answer."""
NUMBER, DOMAIN = (0x2003, 0), (0x2004, 0)
"""Objects to write."""


def clock_slave(node_id: int = NODE_ID) -> CanopenSlave:
    """Return a slave whose objects tell the time of its last tick, in ms."""
    u32, objects = DataType.UNSIGNED32, ObjectTable()
    objects.variable(0x1000, "Device type", u32, RO, 0)
    objects.variable(0x1001, "Error register", DataType.UNSIGNED8, RO)
    objects.variable(0x1017, "Producer heartbeat time", DataType.UNSIGNED16, RW)
    rows = [Element(sub, f"Identity {sub}", u32, RO, sub) for sub in range(1, 5)]
    objects.record(0x1018, "Identity object", rows)
    objects.variable(0x2000, "Clock", u32, RO)
    objects.variable(0x2001, "Text", DataType.VISIBLE_STRING, RO, "0" * 16)
    objects.variable(0x2002, "Time", u32, RO)
    objects.variable(0x2003, "Number", u32, RW)
    objects.variable(0x2004, "Domain", DataType.DOMAIN, RW)
    slave = make_slave(Dictionary(objects, objects.objects), node_id)
    for index, sub in (CLOCK, TIME):
        slave.dictionary[index, sub].source = lambda _: (slave.now_us // 1_000).to_bytes(
            4, "little"
        )
    slave.dictionary[TEXT].source = lambda _: b"%016d" % (slave.now_us // 1_000)
    return slave


@dataclass(frozen=True)
class Passage:
    """What becomes of a frame: how late it is, and how often it arrives."""

    late_us: int = 0
    copies: int = 1


class LatePath:
    """Frames on their way, in order."""

    def __init__(self, passages: Iterable[Passage]) -> None:
        self._passages: Iterator[Passage] = cycle(tuple(passages) or (Passage(),))
        self._frames: deque[tuple[int, CanFrame]] = deque()

    @property
    def due_us(self) -> int:
        return self._frames[0][0] if self._frames else NEVER

    def put(self, now_us: int, frame: CanFrame) -> None:
        passage = next(self._passages)
        earliest_us = self._frames[-1][0] if self._frames else now_us
        due_us = max(earliest_us, now_us + passage.late_us)
        self._frames += [(due_us, frame)] * passage.copies

    def take(self, now_us: int) -> Frames:
        frames = []
        while self.due_us <= now_us:
            frames.append(self._frames.popleft()[1])
        return tuple(frames)


class LateLink:
    """A bus on which the SDO frames of one node are late, each way; all others are in time.

    Args:
        link: the bus.
        answers: what becomes of its answers, in turn.
        requests: what becomes of requests to it, in turn.
    """

    def __init__(
        self, link: StampedLink, answers: Iterable[Passage], requests: Iterable[Passage] = ()
    ) -> None:
        self._link = link
        self.answers, self.requests = LatePath(answers), LatePath(requests)
        self.close = link.close

    @property
    def now_us(self) -> int:
        return self._link.now_us

    def send(self, frames: Frames) -> None:
        for frame in frames:
            if frame.can_id == REQUEST_COB_ID + NODE_ID:
                self.requests.put(self.now_us, frame)
            else:
                self._link.send((frame,))
        self._link.send(self.requests.take(self.now_us))

    def receive(self, timeout_us: int) -> Frames:
        return tuple(frame for _, frame in self.receive_stamped(timeout_us)[1])

    def receive_stamped(self, timeout_us: int) -> tuple[int, StampedFrames]:
        until_us = self.now_us + timeout_us
        while True:
            due_us = min(self.answers.due_us, self.requests.due_us, until_us)
            now_us, received = self._link.receive_stamped(max(0, due_us - self.now_us))
            self._link.send(self.requests.take(now_us))
            ready = []
            for at_us, frame in received:
                if frame.can_id == RESPONSE_COB_ID + NODE_ID:
                    self.answers.put(now_us, frame)
                else:
                    ready.append((at_us, frame))
            ready += [(now_us, frame) for frame in self.answers.take(now_us)]
            if ready or now_us >= until_us:
                return now_us, tuple(ready)
