"""An asynchronous serial line in memory, with its baud rate and finite buffers."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from math import gcd
from typing import Final

from tickrig.device.twin import Copyable
from tickrig.emulators.rig.faults import FaultArguments, FaultTrigger, FaultType
from tickrig.wire.instant import NEVER

# Theory of operation
# ===================
#
# A line is two directions, and a direction is a queue of bursts: bytes that leave back to
# back from `start_us` on. A byte has no event of its own. Everything is worked out from the
# burst when somebody asks: byte n has arrived at start + n * frame_bits / baud, rounded up
# to a whole microsecond. So a megabyte costs as much as a byte, and looking does not change
# anything.
#
# Rules:
#
# - Only the last burst can still be on its way, because a burst that begins while the line
#   is busy is joined to the one before. `unsent`, `drop_unsent` and `last_us` rest on that.
# - Times are never added up. A burst that goes on for hours is shortened at its front
#   (`_forget_taken`) by a number of bytes that takes whole microseconds, so no arrival
#   moves.
# - Two buffers. What the sender's does not take is lost at `put`, what the receiver's does
#   not hold is lost at `take`: both are counted in `lost` of the end that would have
#   received it.
# - `first_us` and `last_us` are kept up to date by `_note_due` after each change, because a
#   rig asks for them far more often than bytes come. `poll` before `first_us` returns at
#   once.
#
# The host's bridge looks once a tick and takes what was written as written right after its
# last look (bridge.py); therefore `_arrived` may be asked for a time before the start of a
# burst.


class SerialLine(Copyable):
    """Two ends joined by two independent directions.

    A byte is delivered when its stop bit has passed. What is sent while the
    line is busy waits its turn; what finds a buffer full is lost and counted.
    Not emulated: parity and framing errors, break, modem control lines.

    Args:
        baud: bit rate in bit/s.
        frame_bits: bits of a byte on the line, 10 for 8N1.
        buffer_bytes: size of each sender's and each receiver's buffer.

    Attributes:
        a: one end, such as the device's.
        b: the other end, such as the host's.

    Raises:
        ValueError: an argument below 1.

    >>> line = SerialLine(baud=115_200)
    >>> line.a.send(0, b"OK:beep")
    >>> line.b.poll(100), line.b.poll(10_000)
    (b'O', b'K:beep')
    """

    def __init__(
        self, baud: int = 115_200, frame_bits: int = 10, buffer_bytes: int = 4_096
    ) -> None:
        if min(baud, frame_bits, buffer_bytes) < 1:
            raise ValueError("baud rate, frame bits and buffer size must be at least 1")
        there = _Direction(baud, frame_bits * 1_000_000, buffer_bytes)
        back = _Direction(baud, frame_bits * 1_000_000, buffer_bytes)
        self.a = LineEnd(back, there)
        self.b = LineEnd(there, back)


class LineEnd:
    """One end of a `SerialLine`; a `Port[bytes]`."""

    __slots__ = ("_in", "_out")

    def __init__(self, incoming: _Direction, outgoing: _Direction) -> None:
        self._in, self._out = incoming, outgoing

    @property
    def due_us(self) -> int:
        """When the next byte will have arrived here."""
        return self._in.first_us

    @property
    def idle_us(self) -> int:
        """When the last byte that is on its way here will have arrived."""
        return self._in.last_us

    @property
    def coming(self) -> bytes:
        """What is on its way here and was not taken."""
        return self._in.coming

    def arrival_us(self, count: int) -> int:
        """Return when so many bytes will have arrived, the last if fewer are on their way."""
        return self._in.arrival_us(count)

    @property
    def lost(self) -> int:
        """Bytes from the other end that found a buffer full."""
        return self._in.lost

    def room(self, now_us: int) -> int:
        """Return how many bytes `send` takes at `now_us` without loss."""
        return self._out.room(now_us)

    @property
    def sent_us(self) -> int:
        """When the last byte sent from here will have passed; past or `NEVER` if it has."""
        return self._out.last_us

    def unsent(self, now_us: int) -> int:
        """Return how many bytes sent from here have not passed yet."""
        return self._out.unsent(now_us)

    def drop_unsent(self, now_us: int) -> None:
        """Forget the bytes sent from here of which no bit is on the line yet."""
        self._out.drop_unsent(now_us)

    def poll(self, now_us: int, /) -> bytes:
        """Take the bytes that have arrived by `now_us`."""
        return self._in.take(now_us)

    def send(self, now_us: int, traffic: bytes, /) -> None:
        """Queue bytes behind those that are still being sent."""
        if traffic:
            self._out.put(now_us, traffic)


class _Burst:
    """Bytes sent back to back."""

    __slots__ = ("data", "start_us", "taken")

    def __init__(self, start_us: int, data: bytes) -> None:
        self.start_us, self.data, self.taken = start_us, data, 0


class _Direction:
    """One direction of the line: only the latest burst can still be on its way."""

    __slots__ = (
        *("_baud", "_buffer_bytes", "_bursts", "_byte_cost", "_held", "_whole_bytes"),
        *("first_us", "last_us", "lost"),
    )

    def __init__(self, baud: int, byte_cost: int, buffer_bytes: int) -> None:
        self._baud, self._byte_cost, self._buffer_bytes = baud, byte_cost, buffer_bytes
        self._whole_bytes = baud // gcd(baud, byte_cost)  # they take a whole number of us
        self._bursts: deque[_Burst] = deque()
        self._held = 0  # bytes in all bursts that are not taken
        self.first_us = self.last_us = NEVER
        self.lost = 0

    def put(self, now_us: int, data: bytes) -> None:
        accepted = data[: self.room(now_us)]
        self.lost += len(data) - len(accepted)
        if not accepted:
            return
        self._held += len(accepted)
        if self._bursts and now_us < self.last_us:
            self._bursts[-1].data += accepted
        else:
            self._bursts.append(_Burst(now_us, accepted))
        self._note_due()

    def take(self, now_us: int) -> bytes:
        if now_us < self.first_us:
            return b""
        taken = []
        while self._bursts:
            burst = self._bursts[0]
            arrived = self._arrived(burst, now_us)
            taken.append(burst.data[burst.taken : arrived])
            burst.taken = arrived
            if arrived < len(burst.data):
                self._forget_taken(burst)
                break
            self._bursts.popleft()
        data = b"".join(taken)
        self._held -= len(data)
        self._note_due()
        self.lost += max(0, len(data) - self._buffer_bytes)
        return data[: self._buffer_bytes]

    @property
    def coming(self) -> bytes:
        return b"".join(burst.data[burst.taken :] for burst in self._bursts)

    def arrival_us(self, count: int) -> int:
        for burst in self._bursts:
            left = len(burst.data) - burst.taken
            if count <= left:
                return self._arrival_us(burst, burst.taken + count)
            count -= left
        return self.last_us

    def room(self, now_us: int) -> int:
        """Return what the sender's buffer takes; the receiver's may overflow later."""
        free = self._buffer_bytes - self.unsent(now_us)
        # A receiver that takes nothing would let bursts pile up: both buffers together are
        # the most.
        return min(free, 2 * self._buffer_bytes - self._held)

    def unsent(self, now_us: int) -> int:
        if not self._bursts or now_us >= self.last_us:
            return 0
        burst = self._bursts[-1]
        return len(burst.data) - self._arrived(burst, now_us)

    def drop_unsent(self, now_us: int) -> None:
        dropped = self.unsent(now_us) - 1  # all but the one that is on the line
        if dropped > 0:
            burst = self._bursts[-1]
            burst.data = burst.data[:-dropped]
            self._held -= dropped
            self._note_due()

    def _forget_taken(self, burst: _Burst) -> None:
        """Drop what was taken of a burst that goes on for long, without moving a time."""
        count = burst.taken - burst.taken % self._whole_bytes
        burst.data, burst.taken = burst.data[count:], burst.taken - count
        burst.start_us += count * self._byte_cost // self._baud

    def _arrived(self, burst: _Burst, now_us: int) -> int:
        passed_us = max(0, now_us - burst.start_us)  # it may be looked at as of an earlier time
        return min(len(burst.data), passed_us * self._baud // self._byte_cost)

    def _arrival_us(self, burst: _Burst, count: int) -> int:
        return burst.start_us - (-count * self._byte_cost // self._baud)

    def _note_due(self) -> None:
        if not self._bursts:
            self.first_us = self.last_us = NEVER
            return
        first, last = self._bursts[0], self._bursts[-1]
        self.first_us = self._arrival_us(first, first.taken + 1)
        self.last_us = self._arrival_us(last, len(last.data))


# Faults of a byte line: flip, drop, dup, cut.


@dataclass(slots=True)
class ByteFault:
    """A fault that hits bits or bytes by chance.

    Attributes:
        trigger: decides which ones.
        arguments: of the fault.
    """

    trigger: FaultTrigger
    arguments: FaultArguments


class _Flip(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        if not (hits := self.trigger.hits(8 * len(data))):
            return data
        turned = bytearray(data)
        for bit in hits:
            turned[bit >> 3] ^= 1 << (bit & 7)
        return bytes(turned)


class _Drop(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        if not (hits := set(self.trigger.hits(len(data)))):
            return data
        return bytes(byte for at, byte in enumerate(data) if at not in hits)


class _Dup(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        hits = set(self.trigger.hits(len(data)))
        return b"".join(bytes([byte]) * (1 + (at in hits)) for at, byte in enumerate(data))


class _Cut(ByteFault):
    def __call__(self, now_us: int, data: bytes) -> bytes:
        self.trigger.tally.allow()
        return b""


BYTE_FAULTS: Final[Mapping[str, FaultType[bytes]]] = {
    "flip": FaultType("each bit is turned over at this rate", _Flip),
    "drop": FaultType("each byte is lost at this rate", _Drop),
    "dup": FaultType("each byte arrives twice at this rate", _Dup),
    "cut": FaultType("nothing passes", _Cut, rated=False),
}
