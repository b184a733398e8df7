"""The host's end of a serial line, with a listener."""

from __future__ import annotations

from collections.abc import Callable

from tickrig.device.twin import itself
from tickrig.emulators.record.trace import Mark
from tickrig.emulators.rig.port import ByteEnd


class HostEnd:
    """A `ByteEnd` that tells what passes it.

    Args:
        end: the end behind it.
        hear: told the time, the direction and the bytes.
    """

    def __init__(self, end: ByteEnd, hear: Callable[[int, Mark, bytes], None]) -> None:
        self._end, self._hear = end, hear

    def __reduce__(self) -> tuple[Callable[[ByteEnd], ByteEnd], tuple[ByteEnd]]:
        """Copy the end alone: nobody listens to a twin."""
        return itself, (self._end,)

    @property
    def due_us(self) -> int:
        """When the next byte will have arrived here."""
        return self._end.due_us

    @property
    def idle_us(self) -> int:
        """When the last byte that is on its way here will have arrived."""
        return self._end.idle_us

    @property
    def lost(self) -> int:
        """Bytes that found a buffer full."""
        return self._end.lost

    def room(self, now_us: int) -> int:
        """Return how many bytes `send` takes at `now_us` without loss."""
        return self._end.room(now_us)

    def poll(self, now_us: int, /) -> bytes:
        """Take what the device sent."""
        if data := self._end.poll(now_us):
            self._hear(now_us, Mark.FROM_DEVICE, data)
        return data

    def send(self, now_us: int, traffic: bytes, /) -> None:
        """Send as the host."""
        self._hear(now_us, Mark.TO_DEVICE, traffic)
        self._end.send(now_us, traffic)
