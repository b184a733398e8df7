"""Frames into a pcapng file, as Wireshark writes it (draft-ietf-opsawg-pcapng).

A section in little-endian order, an interface for each bus, an enhanced packet for each frame.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Final

from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.logs.log_file import LogError, LogFormat, open_log
from tickrig.host.canmon.model.logs.mark import DROP, Mark
from tickrig.host.canmon.model.logs.pcap.block_format import (
    APPLICATION,
    COMMENT,
    DROP_COUNT,
    END,
    IF_NAME,
    INTERFACE,
    ORDER_MAGIC,
    OUTBOUND,
    PACKET,
    PACKET_FLAGS,
    SECTION,
    STATISTICS,
    TIME_RESOLUTION,
    block,
    option,
)
from tickrig.host.canmon.model.logs.pcap.can_packet import (
    CLASSIC_BYTES,
    EXTENDED,
    LINK_TYPE,
    packet,
)
from tickrig.wire.can import CanFrame

_SECTION: Final = struct.Struct("<IHHq")
_INTERFACE: Final = struct.Struct("<HHI")
_PACKET: Final = struct.Struct("<IIIII")
_STATISTICS: Final = struct.Struct("<III")
_USUAL: Final = struct.Struct("<7IIB3x8sI")
_USUAL_BYTES: Final = _USUAL.size
_LOW: Final = 0xFFFF_FFFF
BLOCK_FRAMES: Final = 256


class PcapngWriter:
    """A capture. A mark is a comment of the frame behind it, where Wireshark shows it.

    Raises:
        LogError: a file of pcap, the format before it, which does not name its buses.
        OSError: the file cannot be written.
    """

    def __init__(self, path: Path, kind: LogFormat) -> None:
        if kind is LogFormat.PCAP:
            raise LogError(f"{path}: pcap is read alone; a name in .pcapng is written")
        self._file, self._blocks = open_log(path, "wb"), list[bytes]()
        self._interfaces: dict[str, int] = {}
        self._options = self._comments = b""  # of the frame that comes next
        self._at_us = 0
        content = _SECTION.pack(ORDER_MAGIC, 1, 0, -1)
        self._blocks.append(block(SECTION, content + option(APPLICATION, b"tickrig canmon") + END))

    def write(self, record: Record, /) -> None:
        """Add a frame."""
        at_us, channel, frame, sent = record
        number = self._interfaces.get(channel)
        if number is None:
            number = self._begin(channel)
        if isinstance(frame, CanFrame) and not (sent or self._comments or frame.remote):
            # without the steps below: as quick as a line of candump
            size, length = _USUAL_BYTES, len(frame.data)
            ident = frame.can_id | EXTENDED if frame.extended else frame.can_id
            self._blocks.append(
                _USUAL.pack(
                    *(PACKET, size, number, at_us >> 32, at_us & _LOW, CLASSIC_BYTES),
                    *(CLASSIC_BYTES, _swapped(ident), length, frame.data, size),
                )
            )
        else:
            self._add(at_us, number, packet(frame), sent)
        self._at_us = at_us
        if len(self._blocks) >= BLOCK_FRAMES:
            self._give()

    def mark(self, mark: Mark, /) -> None:
        """Note it at the next frame, frames that were lost as a number too."""
        if mark.event == DROP:
            self._options += option(DROP_COUNT, struct.pack("<Q", mark.frames))
        self._comments += option(COMMENT, mark.text.encode())

    def flush(self) -> None:
        """Give what was added to the operating system."""
        self._give()
        self._file.flush()

    def close(self) -> None:
        """End the capture; marks behind the last frame are in statistics of the first bus."""
        if self._file.closed:
            return
        try:
            if self._comments and self._interfaces:
                content = _STATISTICS.pack(0, self._at_us >> 32, self._at_us & _LOW)
                self._blocks.append(block(STATISTICS, content + self._comments + END))
            self._give()
        finally:
            self._file.close()

    def messages(self) -> list[str]:
        """Nothing: it holds all there is."""
        return []

    def _begin(self, channel: str) -> int:
        options = option(IF_NAME, channel.encode()) + option(TIME_RESOLUTION, b"\x06") + END
        self._blocks.append(block(INTERFACE, _INTERFACE.pack(LINK_TYPE, 0, 0) + options))
        number = self._interfaces[channel] = len(self._interfaces)
        return number

    def _add(self, at_us: int, number: int, data: bytes, sent: bool) -> None:
        options = self._options + self._comments
        self._options = self._comments = b""
        if sent:
            options = option(PACKET_FLAGS, struct.pack("<I", OUTBOUND)) + options
        head = _PACKET.pack(number, at_us >> 32, at_us & _LOW, len(data), len(data))
        self._blocks.append(block(PACKET, head + data + (options + END if options else b"")))

    def _give(self) -> None:
        self._file.write(b"".join(self._blocks))
        self._blocks.clear()


def _swapped(number: int) -> int:
    """Return a number whose little-endian bytes are those of another one in network order."""
    return int.from_bytes(number.to_bytes(4, "big"), "little")
