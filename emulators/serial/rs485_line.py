"""A pair of wires shared by all stations: half duplex, as RS485 with two wires."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from operator import itemgetter

from tickrig.device.twin import Copyable
from tickrig.emulators.rig.port import LineUart
from tickrig.wire.instant import NEVER
from tickrig.wire.uart import UartSetting


class _Burst:
    """Bytes that one end sends back to back.

    Attributes:
        sender: end that sends the bytes.
        start_us: start of the burst.
        end_us: end of the burst.
        data: the bytes as they arrive.
    """

    __slots__ = ("data", "end_us", "sender", "start_us")

    def __init__(self, sender: Rs485End, start_us: int, end_us: int, data: bytearray) -> None:
        self.sender, self.start_us, self.end_us, self.data = sender, start_us, end_us, data


class Rs485Line(Copyable):
    """Several ends on one pair of wires.

    All other ends receive a byte when its stop bit has passed. If two ends send at once, the data
    of both are garbled. Every byte that overlaps a byte of another end arrives with the bits that
    are set in both, and is counted. Data that an end sends while it is still sending are queued.

    Not emulated: the turn-round of the transceivers, a change of the bit rate, framing and parity
    errors. Echo of own bytes is emulated only if requested.

    Args:
        baud: bit rate in bit/s.
        frame_bits: number of bits of a byte on the line, 10 for 8N1.
        buffer_bytes: size of each receiver's buffer and sender's queue.
        ends: number of stations.
        echo: whether each end also receives its own bytes.
        bursts: whether a receiver gets bytes that are sent back to back together at their end, like
            a receiver that waits for an idle line. If false, the receiver gets each byte
            separately.

    Attributes:
        ends: ends of the stations.
        collisions: number of pairs of bytes that overlapped.
        uart: setting of all devices.

    Raises:
        ValueError: a size is below 1, or there are fewer than two ends.

    >>> line = Rs485Line(baud=115_200)
    >>> line.a.send(0, b"who?")
    >>> line.b.poll(10_000)
    b'who?'
    """

    def __init__(  # noqa: PLR0913 - all but the first have defaults
        self,
        baud: int = 115_200,
        frame_bits: int = 10,
        buffer_bytes: int = 4_096,
        ends: int = 2,
        *,
        echo: bool = False,
        bursts: bool = False,
    ) -> None:
        if min(baud, frame_bits, buffer_bytes) < 1 or ends < 2:
            raise ValueError("baud rate, frame bits and buffer size must be at least 1, ends 2")
        self._baud, self._byte_cost, self._echo = baud, frame_bits * 1_000_000, echo
        self._bursts, self.uart = bursts, LineUart(UartSetting(baud))
        self.ends: tuple[Rs485End, ...] = tuple(Rs485End(self, buffer_bytes) for _ in range(ends))
        self.collisions = 0
        self._air: list[_Burst] = []

    @property
    def a(self) -> Rs485End:
        """The first end."""
        return self.ends[0]

    @property
    def b(self) -> Rs485End:
        """The second end."""
        return self.ends[1]

    def put(self, sender: Rs485End, now_us: int, start_us: int, data: bytes) -> int:
        """Send bytes of a station on the RS485 line, without gaps between them.

        Args:
            sender: the station's `Rs485End`.
            now_us: present time in microseconds.
            start_us: start of the first byte.
            data: bytes to send.

        Returns:
            The time in microseconds at which the last byte is complete.
        """
        # A burst is cut at whole microseconds once, at its end; single bytes are worked out
        # from its start.
        end_us = start_us + self.after(len(data))
        burst = _Burst(sender, start_us, end_us, bytearray(data))
        self._air = [other for other in self._air if other.end_us > now_us]
        for other in self._air:
            # Each pair of senders is checked once, when the later of the two starts.
            if other.sender is not sender:
                self._collide(burst, other)
        self._air.append(burst)
        for end in self.ends:
            if end is not sender or self._echo:
                end.hear(burst)
        return end_us

    def cut(self, sender: Rs485End, now_us: int) -> int:
        """Discard the bytes that a station has queued, except the byte that it is just sending.

        Args:
            sender: the station's `Rs485End`.
            now_us: present time in microseconds.

        Returns:
            The time in microseconds at which the byte that is just being sent is complete, or
            `now_us` if the station sends no byte.
        """
        end_us = now_us
        for burst in self._air:
            if burst.sender is sender and burst.end_us > now_us:
                begun_us = now_us - burst.start_us
                # The byte whose start bit has gone out goes on to its end, as in a UART
                # whose buffer is emptied.
                begun = 1 + begun_us * self._baud // self._byte_cost if begun_us >= 0 else 0
                del burst.data[begun:]
                burst.end_us = burst.start_us + self.after(len(burst.data))
                end_us = max(end_us, burst.end_us) if begun else end_us
        return end_us

    def after(self, count: int) -> int:
        """Return the time that the line needs to transmit a number of bytes.

        Args:
            count: number of bytes.

        Returns:
            The duration in microseconds, rounded up.
        """
        return -(-count * self._byte_cost // self._baud)

    def passed(self, burst: _Burst, now_us: int) -> int:
        """Return how many bytes of a burst have arrived at a receiver.

        Args:
            burst: bytes sent without gaps.
            now_us: present time in microseconds.

        Returns:
            The number of bytes since the start of the burst, including those already read.
        """
        if now_us >= burst.end_us:
            return len(burst.data)
        if self._bursts:
            return 0
        return max(0, now_us - burst.start_us) * self._baud // self._byte_cost

    def arrival_us(self, burst: _Burst, taken: int) -> int:
        """Return the time at which a receiver can read more bytes of a burst.

        Args:
            burst: bytes sent without gaps.
            taken: number of bytes that the receiver has already read.

        Returns:
            The time in microseconds.
        """
        return burst.end_us if self._bursts else burst.start_us + self.after(taken + 1)

    def unsent(self, duration_us: int) -> int:
        """Return how many bytes a busy sender has still to send.

        Args:
            duration_us: remaining time for which the sender is busy, in microseconds.

        Returns:
            The number of bytes, rounded up.
        """
        return -(-max(0, duration_us) * self._baud // self._byte_cost)

    def _collide(self, burst: _Burst, other: _Burst) -> None:
        """Garble the overlapping bytes of two bursts."""
        for mine, start_us, end_us in self._bytes(burst):
            for theirs, from_us, to_us in self._bytes(other):
                if start_us < to_us and from_us < end_us:
                    # Dominant 0: two drivers on the pair give the bits that both have set;
                    # garbled bytes arrive.
                    both = burst.data[mine] & other.data[theirs]
                    burst.data[mine] = other.data[theirs] = both
                    self.collisions += 1

    def _bytes(self, burst: _Burst) -> Iterator[tuple[int, int, int]]:
        for at in range(len(burst.data)):
            yield at, burst.start_us + self.after(at), burst.start_us + self.after(at + 1)


class Rs485End:
    """The end of an RS485 line at which one station sends and receives.

    Attributes:
        lost: number of bytes lost because the buffer or the queue of this end was full.
    """

    __slots__ = ("_buffer_bytes", "_busy_us", "_inbox", "_line", "_taken", "lost")

    def __init__(self, line: Rs485Line, buffer_bytes: int) -> None:
        self._line, self._buffer_bytes = line, buffer_bytes
        self._inbox: deque[_Burst] = deque()
        self._taken: deque[int] = deque()  # bytes of each burst that were taken
        self._busy_us = self.lost = 0

    @property
    def due_us(self) -> int:
        """Time at which the next bytes will be available."""
        if not self._inbox:
            return NEVER
        return min(map(self._line.arrival_us, self._inbox, self._taken))

    @property
    def idle_us(self) -> int:
        """Time at which the last byte in transit to this end will have arrived."""
        return max((burst.end_us for burst in self._inbox), default=NEVER)

    @property
    def coming(self) -> bytes:
        """Empty, because bytes in transit can still be garbled."""
        return b""

    def arrival_us(self, count: int) -> int:
        """Return the time of the next check, or `NEVER` if nothing is in transit."""
        return self.due_us

    def room(self, now_us: int) -> int:
        """Return how many bytes `send` accepts at `now_us` without loss."""
        return max(0, self._buffer_bytes - self.unsent(now_us))

    @property
    def sent_us(self) -> int:
        """Time in microseconds at which the station has sent its last byte completely.

        If all bytes have been sent, the time is in the past.
        """
        return self._busy_us

    def unsent(self, now_us: int) -> int:
        """Return how many bytes of this end have not been sent completely yet."""
        return self._line.unsent(self._busy_us - now_us)

    def drop_unsent(self, now_us: int) -> None:
        """Discard the bytes of this end of which no bit has been sent yet."""
        self._busy_us = self._line.cut(self, now_us)

    @property
    def uart(self) -> LineUart:
        """The setting of the line."""
        return self._line.uart

    def use_uart(self, now_us: int, setting: UartSetting) -> None:
        """Raise ValueError if a setting differs from the line's, which devices cannot change."""
        if setting != self._line.uart.setting:
            has = self._line.uart.setting
            raise ValueError(f"a device changes its setting to {setting}: RS-485 keeps {has}")

    def withdraw(self, now_us: int) -> list[tuple[int, int]]:
        """Return nothing, because the setting never changes."""
        return []

    def poll(self, now_us: int, /) -> bytes:
        """Return the bytes that have arrived by `now_us`."""
        if not self._inbox:
            return b""
        out = self._take(now_us) if len(self._inbox) == 1 else self._merge(now_us)
        self.lost += max(0, len(out) - self._buffer_bytes)
        return out[: self._buffer_bytes]

    def send(self, now_us: int, traffic: bytes, /) -> None:
        """Queue bytes after the bytes that this end is still sending."""
        if not traffic:
            return
        accepted = traffic[: self.room(now_us)]
        self.lost += len(traffic) - len(accepted)
        if accepted:
            self._busy_us = self._line.put(self, now_us, max(now_us, self._busy_us), accepted)

    def hear(self, burst: _Burst) -> None:
        """Add a burst in transit to this end."""
        self._inbox.append(burst)
        self._taken.append(0)

    def _take(self, now_us: int) -> bytes:
        """Return the part of the only burst that has passed."""
        burst, taken = self._inbox[0], self._taken[0]
        passed = self._line.passed(burst, now_us)
        if passed == len(burst.data):
            self._inbox.clear()
            self._taken.clear()
        else:
            self._taken[0] = passed
        return bytes(burst.data[taken:passed])

    def _merge(self, now_us: int) -> bytes:
        """Return the parts of several bursts that have passed, in the order of their ends."""
        ended: list[tuple[int, int]] = []
        after, left = self._line.after, list[tuple[_Burst, int]]()
        for burst, taken in zip(self._inbox, self._taken, strict=True):
            passed = self._line.passed(burst, now_us)
            ended += [
                (burst.start_us + after(at + 1), burst.data[at]) for at in range(taken, passed)
            ]
            if passed < len(burst.data):
                left.append((burst, passed))
        self._inbox = deque(burst for burst, _ in left)
        self._taken = deque(taken for _, taken in left)
        ended.sort(key=itemgetter(0))
        return bytes(value for _, value in ended)
