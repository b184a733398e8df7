"""A pair of wires that all stations share: half duplex, as RS485 with two wires is."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from tickrig.device.core import NEVER


@dataclass(slots=True)
class _Byte:
    """A byte on the wires, from its start bit to the end of its stop bit."""

    sender: Rs485End
    start_us: int
    end_us: int
    value: int


class Rs485Line:
    """Several ends on one pair of wires.

    A byte is heard by all other ends when its stop bit has passed. Where two speak at
    once, the wires carry neither: every byte that overlaps one of another end arrives as
    the bits that both have set, and is counted. What an end sends while it is still
    sending waits its turn.

    Not emulated: the turn-round of the transceivers, framing and parity errors, echo of
    one's own bytes unless asked for.

    Args:
        baud: bit rate in bit/s.
        frame_bits: bits of a byte on the line, 10 for 8N1.
        buffer_bytes: size of each receiver's buffer, and of what a sender may queue.
        ends: how many stations there are.
        echo: each end hears its own bytes too.

    Attributes:
        ends: the stations' ends.
        collisions: bytes that overlapped another end's.

    >>> line = Rs485Line(baud=115_200)
    >>> line.a.send(0, b"who?")
    >>> line.b.poll(10_000)
    b'who?'
    """

    def __init__(
        self,
        baud: int = 115_200,
        frame_bits: int = 10,
        buffer_bytes: int = 4_096,
        ends: int = 2,
        *,
        echo: bool = False,
    ) -> None:
        if min(baud, frame_bits, buffer_bytes) < 1 or ends < 2:
            raise ValueError("baud rate, frame bits and buffer size must be at least 1, ends 2")
        self._baud, self._byte_cost, self._echo = baud, frame_bits * 1_000_000, echo
        self.ends = tuple(Rs485End(self, buffer_bytes) for _ in range(ends))
        self.collisions = 0
        self._air: deque[_Byte] = deque()

    @property
    def a(self) -> Rs485End:
        """The first end."""
        return self.ends[0]

    @property
    def b(self) -> Rs485End:
        """The second end."""
        return self.ends[1]

    def put(self, sender: Rs485End, start_us: int, data: bytes) -> int:
        """Put bytes on the wires back to back; return when the last has passed."""
        sent = [
            _Byte(sender, start_us + self._after(at), start_us + self._after(at + 1), value)
            for at, value in enumerate(data)
        ]
        self._collide(sent)
        for end in self.ends:
            if end is not sender or self._echo:
                end.hear(sent)
        return sent[-1].end_us

    def unsent(self, duration_us: int) -> int:
        """Return how many bytes are still to be sent for so long."""
        return -(-max(0, duration_us) * self._baud // self._byte_cost)

    def _after(self, count: int) -> int:
        return -(-count * self._byte_cost // self._baud)

    def _collide(self, sent: list[_Byte]) -> None:
        """Garble what overlaps what another end is still sending."""
        start_us = sent[0].start_us
        self._air = deque(byte for byte in self._air if byte.end_us > start_us)
        for other in self._air:
            for byte in sent:
                apart = byte.end_us <= other.start_us or other.end_us <= byte.start_us
                if byte.sender is not other.sender and not apart:
                    byte.value = other.value = byte.value & other.value
                    self.collisions += 1
        self._air.extend(sent)


class Rs485End:
    """One station's end of an `Rs485Line`; a `Port[bytes]`.

    Attributes:
        lost: bytes that found this end's buffer full, or came in more than it could queue.
    """

    __slots__ = ("_buffer_bytes", "_busy_us", "_inbox", "_line", "lost")

    def __init__(self, line: Rs485Line, buffer_bytes: int) -> None:
        self._line, self._buffer_bytes = line, buffer_bytes
        self._inbox: deque[_Byte] = deque()
        self._busy_us = self.lost = 0

    @property
    def due_us(self) -> int:
        """When the next byte will have arrived here."""
        return self._inbox[0].end_us if self._inbox else NEVER

    @property
    def idle_us(self) -> int:
        """When the last byte that is on its way here will have arrived."""
        return self._inbox[-1].end_us if self._inbox else NEVER

    def room(self, now_us: int) -> int:
        """Return how many bytes `send` takes at `now_us` without loss."""
        return max(0, self._buffer_bytes - self._line.unsent(self._busy_us - now_us))

    def poll(self, now_us: int, /) -> bytes:
        """Take the bytes that have arrived by `now_us`."""
        inbox, out = self._inbox, bytearray()
        while inbox and inbox[0].end_us <= now_us:
            out.append(inbox.popleft().value)
        self.lost += max(0, len(out) - self._buffer_bytes)
        return bytes(out[: self._buffer_bytes])

    def send(self, now_us: int, traffic: bytes, /) -> None:
        """Queue bytes behind those that this end is still sending."""
        accepted = traffic[: self.room(now_us)]
        self.lost += len(traffic) - len(accepted)
        if accepted:
            self._busy_us = self._line.put(self, max(now_us, self._busy_us), accepted)

    def hear(self, sent: list[_Byte]) -> None:
        """Have bytes on their way here, in the order in which they end."""
        inbox = self._inbox
        unordered = inbox and inbox[-1].end_us > sent[0].end_us
        inbox.extend(sent)
        if unordered:
            self._inbox = deque(sorted(inbox, key=lambda byte: byte.end_us))
