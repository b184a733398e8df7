r"""Cut what passes on the line into frames, as the log, transcripts and `expect` show them.

A frame is shown without header and checksum, as `CX`, `CX@I` or
`QV\x03\x04out*\x00\x00\x00`; a packet of RTno as `X`, `XI`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.device.rtc_lite.config import LiteConfig
from tickrig.device.rtc_lite.receiver import BUFFER_BYTES, GAP_US, SILENCE_US, LiteReceiver
from tickrig.emulators.record.wire_log import Splitter
from tickrig.host.links.link import Link
from tickrig.host.text.byte_text import escape
from tickrig.host.text.trace import Mark
from tickrig.wire.rtc_lite.codes import LiteCommand, LiteLinkFault
from tickrig.wire.rtc_lite.decoder import LiteDecoder
from tickrig.wire.rtc_lite.frame import Framing
from tickrig.wire.rtc_lite.layout import REPLIES, REQUESTS
from tickrig.wire.rtc_lite.rtno import RtnoPacketDecoder

SHOWN: Final = {
    LiteLinkFault.CHECKSUM: b"(wrong checksum)",
    LiteLinkFault.UNKNOWN: b"(unknown frame)",
    LiteLinkFault.TIMEOUT: b"(broken off)",
}
"""What is shown of bytes that are no frame."""


def frame_splitter(config: LiteConfig) -> Callable[[Mark], Splitter]:
    """Return what makes the splitter of each direction."""

    def make(mark: Mark) -> Splitter:
        if config.framing is Framing.RTNO:
            return _PacketSplitter().split
        layouts = REQUESTS if mark is Mark.TO_DEVICE else REPLIES
        receiver = LiteReceiver(LiteDecoder(layouts, config.checksum))
        return lambda at_us, data: _split(receiver, at_us, data)

    return make


class _PacketSplitter:
    """Shows packets of RTno without header, length and sum."""

    def __init__(self) -> None:
        self._decoder, self._received_us = RtnoPacketDecoder(), 0

    def split(self, at_us: int, data: bytes) -> list[bytes]:
        out, decoder = list[bytes](), self._decoder
        if at_us >= self._received_us + (SILENCE_US if decoder.lost else GAP_US):
            out += [SHOWN[LiteLinkFault.TIMEOUT]] if decoder.begun else []
            decoder.clear()
        self._received_us = at_us
        for found in decoder.packets(data):
            out.append(SHOWN[found] if isinstance(found, LiteLinkFault) else b"".join(found))
        return out


def _split(receiver: LiteReceiver, at_us: int, data: bytes) -> list[bytes]:
    """Listen as a node listens, with the same time-outs."""
    out = [SHOWN[LiteLinkFault.TIMEOUT]] if receiver.drop_broken_off(at_us) else []
    for at in range(0, len(data), BUFFER_BYTES):
        receiver.push(at_us, data[at : at + BUFFER_BYTES])
        while (found := receiver.pull()) is not None:
            out.append(SHOWN[found] if isinstance(found, LiteLinkFault) else found.body)
    return out


_NAMES: Final = {command.value: command.name for command in LiteCommand}


class MonitoredLink:
    """A `Link[bytes]` that tells each frame that passes through another one.

    Args:
        link: the other one.
        show: called with a line of text, as `> AE  EXECUTE`.

    Attributes:
        shown: whether frames are told just now.
    """

    def __init__(self, link: Link[bytes], show: Callable[[str], None]) -> None:
        self._link, self._show, self.shown = link, show, False
        make = frame_splitter(LiteConfig())
        self._split = {mark: make(mark) for mark in (Mark.TO_DEVICE, Mark.FROM_DEVICE)}

    @property
    def now_us(self) -> int:
        """Time on the link below."""
        return self._link.now_us

    def send(self, traffic: bytes, /) -> None:
        """Send, and tell."""
        self._report(Mark.TO_DEVICE, traffic)
        self._link.send(traffic)

    def receive(self, timeout_us: int, /) -> bytes:
        """Receive, and tell."""
        data = self._link.receive(timeout_us)
        self._report(Mark.FROM_DEVICE, data)
        return data

    def close(self) -> None:
        """Close the link below."""
        self._link.close()

    def _report(self, mark: Mark, data: bytes) -> None:
        for body in self._split[mark](self.now_us, data):
            if self.shown:
                self._show(f"{mark.value} {escape(body):<12} {_NAMES.get(body[:2], '')}".rstrip())
