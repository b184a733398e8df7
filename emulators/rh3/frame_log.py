r"""Cut what passes on the line into frames, shown in hex without their CRC: `01 03 00 00 00 02`."""

from __future__ import annotations

from tickrig.emulators.record.wire_log import Splitter
from tickrig.host.text.trace import Mark
from tickrig.wire.errors import WireError
from tickrig.wire.modbus.rtu import MAX_FRAME_BYTES, SHORTEST_SILENCE_US, parse_frame

CRC_BYTES = 2


def frame_splitter(mark: Mark) -> Splitter:
    """Return what makes frames of one direction."""
    return _FrameSplitter().split


class _FrameSplitter:
    """A frame is whole when its CRC matches; what silence leaves behind is shown as it is."""

    def __init__(self) -> None:
        self._begun, self._received_us = b"", 0

    def split(self, at_us: int, data: bytes) -> list[bytes]:
        out = []
        if self._begun and at_us - self._received_us >= SHORTEST_SILENCE_US:
            out.append(b"(no frame) " + _hex(self._begun))
            self._begun = b""
        self._received_us = at_us
        self._begun = (self._begun + data)[:MAX_FRAME_BYTES]
        try:
            parse_frame(self._begun)
        except WireError:
            return out
        whole, self._begun = self._begun, b""
        return [*out, _hex(whole[:-CRC_BYTES])]


def _hex(data: bytes) -> bytes:
    return data.hex(" ").encode()
