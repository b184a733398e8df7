"""Serial ports as a source, beside buses: the lines of the devices on them.

A port has one reader. Who wants to hear a host and its device hangs the receive
line of an adapter of its own on each of their wires.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import PurePath
from typing import Final

from tickrig.host.canmon.model.decode.serial.rrc_lines import RrcLines
from tickrig.host.canmon.model.decode.serial.rtc_lite_lines import RtcLiteLine
from tickrig.host.canmon.model.frames.record import LineRecord
from tickrig.host.canmon.model.logs.tally import Tally
from tickrig.host.canmon.sources.source_spec import LineSpec
from tickrig.host.links.serial_link import SerialLink
from tickrig.wire.rtc_lite.frame import Checksum

Decoding = tuple[Callable[[str], RrcLines | RtcLiteLine], int]
"""What decodes a line by its name, and its usual bit/s."""

DECODINGS: Final[dict[str, Decoding]] = {
    "rrc": (RrcLines, 115_200),
    "rtc-lite": (RtcLiteLine, 57_600),
    "rtc-lite-xor8": (partial(RtcLiteLine, checksum=Checksum.XOR8), 57_600),
}


class LineReader:
    """One serial port; nothing is sent on it.

    Args:
        word: its port, protocol and direction.

    Attributes:
        name: of its port.
        lost: 0, for a serial port does not tell.
        tally: empty; what is no line is told as one.
        stepped: False, its time passes by itself.

    Raises:
        LinkClosed: the port cannot be opened.
    """

    def __init__(self, word: LineSpec) -> None:
        decoder, usual_baud = DECODINGS[word.protocol]
        self.name, self._from_host = PurePath(word.port).name or word.port, word.from_host
        self.lost, self.tally, self.stepped = 0, Tally(), False
        self._decoder = decoder(self.name)
        self._link = SerialLink(word.port, word.baud or usual_baud)

    def read(self, timeout_us: int, /) -> list[LineRecord]:
        """Wait for a first byte, then return the lines that are whole; LinkClosed if it is gone."""
        data = self._link.receive(timeout_us)
        at_us = time.time_ns() // 1_000
        return self._decoder.take(at_us, data, to_device=self._from_host) if data else []

    def close(self) -> None:
        """Close the port."""
        self._link.close()
