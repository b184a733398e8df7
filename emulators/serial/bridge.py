"""Join an emulated serial line with a port of the outside world."""

from __future__ import annotations

from tickrig.emulators.rig.port import ByteEnd, Port


class Bridge:
    """The far end of a line, handed to the outside: a pty, a socket, a real port.

    The line keeps its baud rate: what the outside writes at once arrives at the
    device byte by byte, and what does not fit into the line's buffer stays in
    the outside's until it does.
    """

    def __init__(self, end: ByteEnd, outside: Port[bytes]) -> None:
        self._end, self._outside = end, outside
        self._pending = b""
        self._looked_us = 0

    @property
    def due_us(self) -> int:
        """When the bytes now on the line will all have arrived at this end."""
        return self._end.idle_us

    def take_in(self, now_us: int) -> None:
        """Put what the outside wrote since the last look on the line.

        It may have been written at any time since then, so it is taken as
        written right after that look: a host is not charged a tick for being
        polled.
        """
        if not self._pending:
            self._pending = self._outside.poll(now_us)
        if self._pending:
            room = self._end.room(self._looked_us)
            self._end.send(self._looked_us, self._pending[:room])
            self._pending = self._pending[room:]
        self._looked_us = now_us

    def give_out(self, now_us: int) -> None:
        """Hand what has arrived by now to the outside."""
        if data := self._end.poll(now_us):
            self._outside.send(now_us, data)
