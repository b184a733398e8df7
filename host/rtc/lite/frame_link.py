"""Frames over a byte link: those of RTC-Lite, or packets of RTno in their place."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Final, Protocol

from tickrig.host.links.errors import LinkError
from tickrig.host.links.link import Link
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_lite.codes import LiteCommand, LiteLinkFault, LiteStatus
from tickrig.wire.rtc_lite.frame import LiteFrame
from tickrig.wire.rtc_lite.rtno import LETTERS, RtnoReplies, encode_request

SILENCE_US: Final = 20_000
"""Silence after which the rest of a broken frame is not waited for."""

KEPT: Final = 8
"""Frames that are kept, for who wants to know what was said last."""

_LOG: Final = log_of(__name__)


class ReplyDecoder(Protocol):
    """`Decoder` or `RtnoReplies`."""

    @property
    def lost(self) -> bool:
        """Whether all is thrown away until `clear`."""
        ...

    def clear(self) -> None:
        """Look for a header again."""

    def push(self, data: bytes, /) -> list[LiteFrame | LiteLinkFault]:
        """Take bytes in; give frames and faults out."""
        ...


class FrameLink:
    """A `Link[LiteFrame]`, one way requests, the other way replies.

    A line that is gone is as silent as a device without power. What is no
    frame is left out; after an unknown command the next header is looked for
    at once, as the checksum tells what is a frame.

    Args:
        link: the line.
        encode: writes a request.
        decoder: reads the replies.

    Attributes:
        latest: the last frames with their times, as `1.234 > CX`, `1.238 < CX@I`.
    """

    def __init__(
        self, link: Link[bytes], encode: Callable[[LiteFrame], bytes], decoder: ReplyDecoder
    ) -> None:
        self._link, self._encode, self._decoder = link, encode, decoder
        self._byte_us = link.now_us
        self.latest: deque[str] = deque(maxlen=KEPT)

    @property
    def now_us(self) -> int:
        """Time on the clock of the link."""
        return self._link.now_us

    def send(self, frame: LiteFrame) -> None:
        """Send a frame; a broken one that came long before is not waited for any more."""
        if self.now_us - self._byte_us >= SILENCE_US:
            self._decoder.clear()
        self._note(">", frame)
        try:
            self._link.send(self._encode(frame))
        except LinkError as error:
            _LOG.debug("not sent: %s", error)

    def receive(self, timeout_us: int) -> list[LiteFrame] | None:
        """Wait for bytes, and return the frames that they complete; None if the line is gone."""
        try:
            data = self._link.receive(timeout_us)
        except LinkError as error:
            _LOG.debug("not heard: %s", error)
            return None
        if data:
            self._byte_us = self.now_us
        if self._decoder.lost:
            self._decoder.clear()
        frames = [found for found in self._decoder.push(data) if isinstance(found, LiteFrame)]
        for frame in frames:
            self._note("<", frame)
        return frames

    def _note(self, arrow: str, frame: LiteFrame) -> None:
        _LOG.debug("%s %s", arrow, frame.body)
        self.latest.append(f"{self.now_us / 1e6:.3f} {arrow} {str(frame.body)[2:-1]}")


class RtnoLink(FrameLink):
    """Says what RTno has a letter for, and makes up for the rest.

    | asked for | said instead |
    |---|---|
    | PING | `X`, the state; its answer is that to the PING, too |
    | abort | `D`, deactivate: the device is Inactive then, and only its proxy in Error |
    | initialize, finalize, on_startup, on_shutdown, rate, poll | nothing; the reply is `!` |

    Args:
        link: the line.
    """

    def __init__(self, link: Link[bytes]) -> None:
        super().__init__(link, encode_request, RtnoReplies())
        self._ping = b""  # number of the PING that waits for its answer
        self._aborts = False
        self._made_up: list[LiteFrame] = []

    def send(self, frame: LiteFrame) -> None:
        """Send a request, or what stands for it."""
        self._aborts = frame.command is LiteCommand.ABORT
        if frame.command is LiteCommand.PING:
            self._ping = frame.data
            super().send(LiteFrame(LiteCommand.STATE))
        elif self._aborts:
            super().send(LiteFrame(LiteCommand.DEACTIVATE))
        elif frame.command in LETTERS:
            super().send(frame)
        else:
            self._made_up.append(LiteFrame(frame.command, bytes([LiteStatus.UNSUPPORTED])))

    def receive(self, timeout_us: int) -> list[LiteFrame] | None:
        """Wait for bytes, and return the frames that they complete; None if the line is gone."""
        made_up, self._made_up = self._made_up, []
        frames = super().receive(0 if made_up else timeout_us)
        if frames is None:
            return None
        for frame in frames:
            made_up += self._translate(frame)
        return made_up

    def _translate(self, frame: LiteFrame) -> list[LiteFrame]:
        if frame.command is LiteCommand.STATE and self._ping:
            number, self._ping = self._ping, b""
            return [frame, LiteFrame(LiteCommand.PING, bytes([LiteStatus.OK]) + number)]
        if frame.command is LiteCommand.DEACTIVATE and self._aborts:
            return [LiteFrame(LiteCommand.ABORT, frame.data)]
        return [frame]
