"""Frames in captures of Wireshark, tshark and tcpdump: pcapng, and pcap before it.

Which of the two a file is, its first bytes tell, not its name.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Final, cast

from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.logs.log_file import LogError, LogFormat, open_log
from tickrig.host.canmon.model.logs.log_reader import Item
from tickrig.host.canmon.model.logs.notation import UNNAMED
from tickrig.host.canmon.model.logs.pcap.block_format import SECTION
from tickrig.host.canmon.model.logs.pcap.can_packet import LINK_TYPE, parse_packet
from tickrig.host.canmon.model.logs.pcap.pcapng_reader import MOST_BYTES, PcapngReader
from tickrig.host.canmon.model.logs.tally import BAD_PACKETS, OTHER_PACKETS, Tally

_PCAP: Final = {
    bytes.fromhex("d4c3b2a1"): ("<", 1),
    bytes.fromhex("a1b2c3d4"): (">", 1),
    bytes.fromhex("4d3cb2a1"): ("<", 1_000),
    bytes.fromhex("a1b23c4d"): (">", 1_000),
}
"""First bytes of a pcap file: byte order, and fractions of a second in a microsecond."""

_HEAD_BYTES: Final = 24
_LINK_TYPE_AT: Final = 20


class PcapReader:
    """A reader of the frames in a capture."""

    def __init__(self, path: Path, kind: LogFormat) -> None:
        self._path, self.tally = path, Tally()

    def __iter__(self) -> Iterator[Record]:
        """Read the file."""
        return cast("Iterator[Record]", self._items(marks=False))

    def items(self) -> Iterator[Item]:
        """Read the file, with the marks among its frames."""
        return self._items(marks=True)

    def _items(self, *, marks: bool) -> Iterator[Item]:
        self.tally = Tally()
        try:
            with open_log(self._path) as file:
                yield from self._frames(file, marks)
        except (EOFError, zlib.error, OSError) as error:
            if isinstance(error, OSError) and error.errno is not None:
                raise
            raise LogError(f"{self._path}: {error}") from error

    def _frames(self, file: BinaryIO, marks: bool) -> Iterator[Item]:
        first = file.read(4)
        if first == SECTION.to_bytes(4, "little"):
            yield from PcapngReader(str(self._path), self.tally, marks).frames(file, first)
        elif first in _PCAP:
            yield from self._packets(file, *_PCAP[first])
        else:
            raise LogError(f"{self._path} is no capture: it begins with {first.hex() or 'nothing'}")

    def _packets(self, file: BinaryIO, order: str, parts: int) -> Iterator[Record]:
        """Yield the frames of a pcap file, which names no bus."""
        head = file.read(_HEAD_BYTES - 4)
        if len(head) < _HEAD_BYTES - 4:
            raise LogError(f"{self._path}: it is cut in its header")
        (link_type,) = struct.unpack_from(f"{order}I", head, _LINK_TYPE_AT - 4)
        heading, count = struct.Struct(f"{order}4I"), 0
        while begun := file.read(heading.size):
            size = heading.unpack(begun)[2] if len(begun) == heading.size else 0
            if size > MOST_BYTES:
                raise LogError(f"{self._path}: a packet of {size} bytes behind {count} packets")
            data = file.read(size)
            if len(begun) < heading.size or len(data) < size:
                raise LogError(f"{self._path}: it is cut after {count} packets")
            count += 1
            seconds, fraction, _, _ = heading.unpack(begun)
            if link_type & 0xFFFF != LINK_TYPE:
                self.tally.passed_over[OTHER_PACKETS] += 1
                continue
            frame = parse_packet(data)
            if frame is None or isinstance(frame, str):
                self.tally.passed_over[frame or BAD_PACKETS] += 1
            else:
                yield Record(seconds * 1_000_000 + fraction // parts, UNNAMED, frame)
