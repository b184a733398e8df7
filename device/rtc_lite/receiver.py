"""Bytes from the line: a buffer of 64, frames out of it, and time-outs (DECISION L7)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, Protocol

from tickrig.wire.instant import NEVER
from tickrig.wire.rtc_lite.codes import LiteLinkFault
from tickrig.wire.rtc_lite.frame import LiteFrame

BUFFER_BYTES: Final = 64
GAP_US: Final = 100_000
"""Silence inside a frame that drops it."""
SILENCE_US: Final = 20_000
"""Silence that a receiver needs after a frame whose length it does not know."""


class RequestDecoder(Protocol):
    """`Decoder` or `RtnoDecoder`."""

    lost: bool

    @property
    def begun(self) -> bool:
        """Whether a frame has begun that is not whole."""
        ...

    def clear(self) -> None:
        """Look for a header again."""

    def push(self, data: bytes, /) -> list[LiteFrame | LiteLinkFault]:
        """Take bytes in; give frames and faults out."""
        ...


@dataclass(slots=True)
class LiteReceiver:
    """What the line brought.

    Attributes:
        decoder: reads the frames.
        dropped: bytes that found the buffer full.
    """

    decoder: RequestDecoder
    dropped: int = field(default=0, init=False)
    _waiting: bytes = field(default=b"", init=False)
    _received_us: int = field(default=0, init=False)  # when the latest byte came

    @property
    def due_us(self) -> int:
        """When a frame that has begun is dropped."""
        return self._received_us + GAP_US if self.decoder.begun else NEVER

    def push(self, now_us: int, data: bytes) -> None:
        """Take bytes from the line, as many as there is room for."""
        if not data:
            return
        if self.decoder.lost and now_us - self._received_us >= SILENCE_US:
            self.decoder.clear()
        self._received_us = now_us
        if not self.decoder.lost:
            room = BUFFER_BYTES - len(self._waiting)
            self._waiting += data[:room]
            self.dropped += max(0, len(data) - room)

    def drop_broken_off(self, now_us: int) -> bool:
        """Drop a frame that was broken off; True if there was one."""
        if self._waiting or now_us < self.due_us:
            return False
        self.decoder.clear()
        return True

    def pull(self) -> LiteFrame | LiteLinkFault | None:
        """Return the next frame or fault, and leave what follows it in the buffer."""
        for at in range(len(self._waiting)):
            for found in self.decoder.push(self._waiting[at : at + 1]):
                self._waiting = b"" if self.decoder.lost else self._waiting[at + 1 :]
                return found
        self._waiting = b""
        return None
