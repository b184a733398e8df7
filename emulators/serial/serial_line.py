"""An asynchronous serial line in memory, with its baud rate and finite buffers."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import gcd

from tickrig._compiled import mypyc_attr
from tickrig.device.twin import Copyable, Part
from tickrig.emulators.rig.port import LineUart
from tickrig.wire.instant import NEVER
from tickrig.wire.uart import PS_PER_US, UartSetting

# Theory of operation
# ===================
#
# A line is two directions, and a direction is a queue of bursts. A burst is a number of bytes that
# are sent back to back from `start_us` on. A byte has no event of its own. Its arrival is computed
# from the burst on request: byte n has arrived at start + n * frame_bits / baud, rounded up to a
# whole microsecond. So a megabyte costs as much as a byte, and a query does not change anything.
#
# Rules:
#
# - A burst that begins while the line is busy is joined to the previous burst, so only the last
#   burst can still be in transit. There is one exception: after a change of the setting the next
#   burst has other times, so it waits after the previous one. `_unsent_bursts` finds both.
# - A device changes the setting of the whole line (`use_uart`): after the last stop bit that
#   it has sent, or at once. Until then bytes of the host keep the old times (`_from_us`).
# - Times are never added up. A burst that lasts for hours is shortened at its front
#   (`forget_taken`) by a number of bytes whose duration is a whole number of microseconds. So no
#   arrival changes.
# - There are two buffers. Bytes that do not fit into the sender's buffer are lost at `put`. Bytes
#   that do not fit into the receiver's buffer are lost at `take`. Both are counted in `lost` of
#   the end that would have received them.
# - `_note_due` updates `first_us` and `last_us` after each change, because a rig reads them far
#   more often than bytes arrive. `poll` before `first_us` returns at once.
#
# The host's bridge polls once a tick and treats new data as written right after its previous poll
# (bridge.py). Therefore `arrived` may be called with a time before the start of a burst.


@mypyc_attr(allow_interpreted_subclasses=True, serializable=True)
class SerialLine(Copyable):
    """Two ends joined by two independent directions.

    A byte is delivered when its stop bit has passed. Data sent while the line is busy are queued.
    Data that do not fit into a buffer are lost and counted. A device may change the setting
    (`LineEnd.use_uart`). If the host has another setting, its end computes the characters that
    pass (`SerialSide`, `Bridge`).

    Not emulated: modem control lines.

    Args:
        baud: bit rate in bit/s.
        frame_bits: number of bits of a byte on the line, 10 for 8N1.
        buffer_bytes: size of the buffer of each sender and each receiver.

    Attributes:
        a: one end, such as the device's.
        b: the other end, such as the host's.

    Raises:
        ValueError: an argument is below 1.

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
        timing = _Timing(baud, frame_bits * 1_000_000)
        there, back = _Direction(timing, buffer_bytes), _Direction(timing, buffer_bytes)
        uart = LineUart(UartSetting(baud))
        self.a = LineEnd(back, there, uart)
        self.b = LineEnd(there, back, uart)


class LineEnd(Part):
    """One end of a `SerialLine`; a `Port[bytes]`."""

    __slots__ = ("_in", "_out", "uart")

    def __init__(self, incoming: _Direction, outgoing: _Direction, uart: LineUart) -> None:
        self._in, self._out, self.uart = incoming, outgoing, uart

    def use_uart(self, now_us: int, setting: UartSetting) -> None:
        """Change the UART setting of the device at this end, after the last byte that it has sent.

        Args:
            now_us: present time in microseconds.
            setting: the new setting.
        """
        uart = self.uart
        if setting == uart.setting:
            return
        since_us = max(now_us, self._out.last_us) if self._out.unsent(now_us) else now_us
        timing = _Timing(setting.baud, int(setting.frame_bits * 1_000_000))
        self._out.change(since_us, timing)
        self._in.change(since_us, timing)
        uart.setting, uart.since_us = setting, since_us
        for listener in uart.listeners:
            listener(since_us, setting)

    def withdraw(self, now_us: int) -> list[tuple[int, int]]:
        """Cancel all bytes that this end has sent and that have not arrived at the other end yet.

        Args:
            now_us: present time in microseconds.

        Returns:
            For each byte the start of its start bit in picoseconds, and its value.
        """
        return self._out.withdraw(now_us)

    @property
    def due_us(self) -> int:
        """Time at which the next byte will have arrived here."""
        return self._in.first_us

    @property
    def idle_us(self) -> int:
        """Time at which the last byte in transit to this end will have arrived."""
        return self._in.last_us

    @property
    def coming(self) -> bytes:
        """The bytes in transit to this end."""
        return self._in.coming

    def arrival_us(self, count: int) -> int:
        """Return the time at which `count` bytes will have arrived at this end.

        If fewer bytes are in transit, it is the time at which all of them will have arrived.
        """
        return self._in.arrival_us(count)

    @property
    def lost(self) -> int:
        """Number of bytes from the other end lost because of a full buffer."""
        return self._in.lost

    def room(self, now_us: int) -> int:
        """Return how many bytes `send` accepts at `now_us` without loss."""
        return self._out.room(now_us)

    @property
    def sent_us(self) -> int:
        """Time at which all bytes that were queued here with `send` will have been sent.

        If all bytes have been sent, the result is a time in the past or `NEVER`, with the same
        meaning.
        """
        return self._out.last_us

    def unsent(self, now_us: int) -> int:
        """Return how many bytes of this end have not been sent completely yet."""
        return self._out.unsent(now_us)

    def drop_unsent(self, now_us: int) -> None:
        """Discard the bytes of this end of which no bit has been sent yet."""
        self._out.drop_unsent(now_us)

    def poll(self, now_us: int, /) -> bytes:
        """Return the bytes that have arrived by `now_us`."""
        return self._in.take(now_us)

    def send(self, now_us: int, traffic: bytes, /) -> None:
        """Queue bytes after the bytes that are still being sent."""
        if traffic:
            self._out.put(now_us, traffic)


@dataclass
class _Timing(Part):
    """Duration of bytes; `byte_cost` is the number of bits of a byte, in millionths."""

    baud: int
    byte_cost: int

    @property
    def whole_bytes(self) -> int:
        """A number of bytes that takes a whole number of us."""
        return self.baud // gcd(self.baud, self.byte_cost)


class _Burst(Part):
    """Bytes sent back to back."""

    __slots__ = ("data", "start_us", "taken", "timing")

    def __init__(self, start_us: int, data: bytes, timing: _Timing) -> None:
        self.start_us, self.data, self.taken, self.timing = start_us, data, 0, timing

    def arrived(self, now_us: int) -> int:
        """Return how many bytes have arrived by `now_us`."""
        passed_us = max(0, now_us - self.start_us)  # it may be looked at as of an earlier time
        return min(len(self.data), passed_us * self.timing.baud // self.timing.byte_cost)

    def arrival_us(self, count: int) -> int:
        """Return the time at which a number of bytes has arrived, rounded up."""
        return self.start_us - (-count * self.timing.byte_cost // self.timing.baud)

    def forget_taken(self) -> None:
        """Drop the taken part of a long burst without changing any time."""
        count = self.taken - self.taken % self.timing.whole_bytes
        self.data, self.taken = self.data[count:], self.taken - count
        self.start_us += count * self.timing.byte_cost // self.timing.baud


class _Direction(Part):
    """One direction of the line. Only the latest burst can still be in transit."""

    __slots__ = (
        *("_buffer_bytes", "_bursts", "_from_us", "_held", "_next", "_timing"),
        *("first_us", "last_us", "lost"),
    )

    def __init__(self, timing: _Timing, buffer_bytes: int) -> None:
        self._timing, self._buffer_bytes = timing, buffer_bytes
        self._next, self._from_us = timing, 0  # the latest change, and from when on it counts
        self._bursts: deque[_Burst] = deque()
        self._held = 0  # bytes in all bursts that are not taken
        self.first_us = self.last_us = NEVER
        self.lost = 0

    def change(self, from_us: int, timing: _Timing) -> None:
        """Use another timing for data that start at `from_us` or later."""
        if from_us > self._from_us:
            self._timing = self._next
        self._next, self._from_us = timing, from_us

    def put(self, now_us: int, data: bytes) -> None:
        accepted = data[: self.room(now_us)]
        self.lost += len(data) - len(accepted)
        if not accepted:
            return
        self._held += len(accepted)
        busy = bool(self._bursts) and now_us < self.last_us
        start_us = self.last_us if busy else now_us
        timing = self._next if start_us >= self._from_us else self._timing
        last = self._bursts[-1] if busy else None
        if last is not None and (last.timing is timing or last.timing == timing):
            last.data += accepted
        else:
            self._bursts.append(_Burst(start_us, accepted, timing))
        self._note_due()

    def take(self, now_us: int) -> bytes:
        if now_us < self.first_us:
            return b""
        if now_us >= self.last_us:
            data = self.coming
            self._bursts.clear()
        else:
            data = self._take_arrived(now_us)
        self._held -= len(data)
        self._note_due()
        self.lost += max(0, len(data) - self._buffer_bytes)
        return data[: self._buffer_bytes]

    def _take_arrived(self, now_us: int) -> bytes:
        """Take the bytes that have arrived while others are in transit."""
        taken = []
        while True:
            burst = self._bursts[0]
            arrived = burst.arrived(now_us)
            taken.append(burst.data[burst.taken : arrived])
            burst.taken = arrived
            if arrived < len(burst.data):
                burst.forget_taken()
                return b"".join(taken)
            self._bursts.popleft()

    @property
    def coming(self) -> bytes:
        return b"".join([burst.data[burst.taken :] for burst in self._bursts])

    def arrival_us(self, count: int) -> int:
        for burst in self._bursts:
            left = len(burst.data) - burst.taken
            if count <= left:
                return burst.arrival_us(burst.taken + count)
            count -= left
        return self.last_us

    def room(self, now_us: int) -> int:
        """Return the data that fit into the sender's buffer; the receiver may overflow later."""
        free = self._buffer_bytes - self.unsent(now_us)
        # A receiver that takes nothing would let bursts pile up: both buffers together are
        # the most.
        return min(free, 2 * self._buffer_bytes - self._held)

    def unsent(self, now_us: int) -> int:
        if not self._bursts or now_us >= self.last_us:
            return 0
        unsent = self._unsent_bursts(now_us)
        return sum(len(burst.data) - burst.arrived(now_us) for burst in unsent)

    def drop_unsent(self, now_us: int) -> None:
        for burst in self._unsent_bursts(now_us):
            begun = burst.arrived(now_us) + (burst.start_us <= now_us)  # and the one on the line
            self._cut(burst, begun)
        self._tidy()

    def withdraw(self, now_us: int) -> list[tuple[int, int]]:
        withdrawn = []
        for burst in self._unsent_bursts(now_us):
            timing, arrived = burst.timing, burst.arrived(now_us)
            for at in range(arrived, len(burst.data)):
                passed_ps = at * timing.byte_cost * PS_PER_US // timing.baud
                withdrawn.append((burst.start_us * PS_PER_US + passed_ps, burst.data[at]))
            self._cut(burst, arrived)
        self._tidy()
        return withdrawn

    def _unsent_bursts(self, now_us: int) -> deque[_Burst]:
        """Return the bursts that have not arrived entirely, the earliest first."""
        unsent = deque[_Burst]()
        for burst in reversed(self._bursts):
            if burst.arrival_us(len(burst.data)) <= now_us:
                break
            unsent.appendleft(burst)
        return unsent

    def _cut(self, burst: _Burst, count: int) -> None:
        self._held -= max(0, len(burst.data) - count)
        burst.data = burst.data[:count]

    def _tidy(self) -> None:
        """Discard bursts that have been taken completely."""
        self._bursts = deque(each for each in self._bursts if each.taken < len(each.data))
        self._note_due()

    def _note_due(self) -> None:
        if not self._bursts:
            self.first_us = self.last_us = NEVER
            return
        first, last = self._bursts[0], self._bursts[-1]
        self.first_us = first.arrival_us(first.taken + 1)
        self.last_us = last.arrival_us(len(last.data))
