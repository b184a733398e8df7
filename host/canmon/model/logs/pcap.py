"""Captures of Wireshark, tshark and tcpdump. pcapng is read and written, pcap is read.

The module reads and writes blocks and options of a pcapng file (draft-ietf-opsawg-pcapng).

>>> _option(_COMMENT, b"hi").hex(), list(options("<", _option(_COMMENT, b"hi") + _END))
('0100020068690000', [(1, b'hi')])

Frames are packets of a capture, as in LINKTYPE_CAN_SOCKETCAN (tcpdump.org).

A packet is a struct can_frame or canfd_frame of Linux with the identifier in network byte order.

>>> packet(can.CanFrame.parse("705#7F")).hex()
'00000705010000007f00000000000000'
>>> str(_parse_packet(packet(can.FdFrame.parse("00000123##1AABB"))))
'00000123##1AABB'
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Iterator
from io import BufferedReader
from pathlib import Path
from typing import BinaryIO, Final, Literal, NamedTuple, cast

from tickrig.host.canmon.model.frames import EXTENDED, REMOTE, AnyFrame, Record
from tickrig.host.canmon.model.logs import log_file
from tickrig.host.canmon.model.logs.log_reader import Item
from tickrig.host.canmon.model.logs.notation import LONGEST_NAME, UNNAMED
from tickrig.wire import can

# A block: type (4), size (4), content, size again (4); each is a multiple of four bytes.
# The type of a section is the same in both byte orders, and the magic behind its size tells
# which it is:
#
# 0A0D0D0A size 1A2B3C4D 1 0 -1 options size     section
# 00000001 size 227 0 snap options size          interface: link type, name, resolution of times
# 00000006 size interface high low len len data  packet, padded, then options
_SECTION_BLOCK: Final = 0x0A0D_0D0A
_ORDER_MAGIC: Final = 0x1A2B_3C4D
_INTERFACE_BLOCK: Final = 1
_OBSOLETE_PACKET: Final = 2
_SIMPLE_PACKET: Final = 3
_STATISTICS_BLOCK: Final = 5
_PACKET_BLOCK: Final = 6
"""Types of blocks."""

_COMMENT: Final = 1
_APPLICATION: Final = 4
"""Options of any block, and the option of a section that names the writing application."""

_IF_NAME: Final = 2
_TIME_RESOLUTION: Final = 9
_TIME_OFFSET: Final = 14
"""Options of an interface."""

_PACKET_FLAGS: Final = 2
_DROP_COUNT: Final = 4
"""Options of a packet."""

_DIRECTION: Final = 3
_OUTBOUND: Final = 2
"""Flags of a packet: the mask of its direction, and the value for sent packets."""

_BLOCK_BYTES: Final = 12
"""Number of bytes of a block without content."""

_END: Final = bytes(4)
"""End of options."""


def _block(kind: int, content: bytes) -> bytes:
    """Return a block in little-endian order. The length of its content is a multiple of 4 bytes."""
    size = len(content) + _BLOCK_BYTES
    return struct.pack("<II", kind, size) + content + struct.pack("<I", size)


def _option(code: int, value: bytes) -> bytes:
    """Return an option in little-endian order."""
    return struct.pack("<HH", code, len(value)) + value + bytes(-len(value) % 4)


def options(order: str, data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield the code and the value of each complete option of a pcapng block.

    `order` is the byte order, `<` or `>` as in `struct`.
    """
    head, at = struct.Struct(f"{order}HH"), 0
    while at + head.size <= len(data):
        code, size = head.unpack_from(data, at)
        at += head.size
        if not code or at + size > len(data):
            return
        yield code, data[at : at + size]
        at += size + -size % 4


_LINK_TYPE: Final = 227
"""Number of LINKTYPE_CAN_SOCKETCAN."""

_FDF: Final = 0x4
"""Flag of a packet that is a CAN FD frame, however short it was cut."""
_XL: Final = 0x80

# struct can_frame: id (4, network order), length (1), 3 reserved, 8 data; struct
# canfd_frame: id (4), length (1), flags (1), 2 reserved, 64 data. The flags of the id are
# those of linux/can.h: 80000000h extended, 40000000h remote, 20000000h error.
_CLASSIC_BYTES: Final = 16
_FD_BYTES: Final = 72
_CLASSIC: Final = struct.Struct(">IB3x8s")
_FD: Final = struct.Struct(">IBB2x64s")
_HEAD: Final = struct.Struct(">IBB")
_LENGTH_AT: Final = 4
_DATA_AT: Final = 8


def packet(frame: AnyFrame) -> bytes:
    """Return a frame as the data of a SocketCAN packet: 16 bytes, or 72 bytes for CAN FD."""
    if isinstance(frame, can.FdFrame):
        flagged = frame.can_id | EXTENDED * frame.extended
        return _FD.pack(flagged, len(frame.data), _FDF | frame.flags, frame.data)
    if isinstance(frame, can.ErrorFrame):
        return _CLASSIC.pack(can.ERROR_FLAG | frame.error_class, len(frame.data), frame.data)
    flagged = frame.can_id | EXTENDED * frame.extended | REMOTE * frame.remote
    return _CLASSIC.pack(flagged, frame.dlc, frame.data)


def _parse_packet(data: bytes) -> AnyFrame | str | None:
    """Return the frame of a packet, `CAN_XL`, or None for other or truncated packets."""
    if len(data) < _DATA_AT or data[_LENGTH_AT] & _XL:
        return None if len(data) < _DATA_AT else log_file.CAN_XL
    flagged, length, flags = _HEAD.unpack_from(data)
    content = data[_DATA_AT : _DATA_AT + length]
    if flagged & can.ERROR_FLAG:
        return can.ErrorFrame(flagged & can.ERROR_CLASS_MASK, content[:8].ljust(8, b"\0"))
    extended = bool(flagged & EXTENDED)
    can_id = flagged & (can.EXTENDED_MAX if extended else can.STANDARD_MAX)
    if flagged & REMOTE:
        return can.CanFrame(can_id, b"", True, extended, min(length, can.MAX_DATA_BYTES))
    # Older captures leave the flags empty: then the size of the structure tells CAN FD.
    is_fd = flags & _FDF or len(data) == _FD_BYTES
    if len(content) < length or length > (can.MAX_FD_BYTES if is_fd else can.MAX_DATA_BYTES):
        return None
    if is_fd:
        return can.FdFrame(can_id, content, extended, flags & (can.BRS | can.ESI)).checked()
    return can.CanFrame(can_id, content, False, extended)


# The frames in a pcapng file (draft-ietf-opsawg-pcapng), in either byte order.
#
# The reader handles sections, interfaces, and packets in enhanced, simple and obsolete blocks, and
# skips others. Times of any resolution are truncated to microseconds.

_MOST_BYTES: Final = 1 << 24
"""Number of bytes of a block above which the file is damaged."""

_CUT: Final = "it is cut"
_READ_BYTES: Final = 1 << 16
_MICROS: Final = 1_000_000
_USUAL_BYTES: Final = 48
_END_US: Final = log_file.END_S * _MICROS
_END_HIGH: Final = _END_US >> 32


class _Interface(NamedTuple):
    """An interface on which packets were captured.

    Attributes:
        name: name of the bus.
        is_can: whether the packets of the interface are CAN frames.
        parts: number of time units per second.
        offset_us: offset added to the times.
        snap_bytes: size to which packets are truncated, or 0 for no limit.
    """

    name: str
    is_can: bool
    parts: int
    offset_us: int
    snap_bytes: int


class _Usual(NamedTuple):
    """The layout of a block with a classic data frame without options, and its content."""

    layout: struct.Struct
    head: bytes
    sizes: bytes
    tail: bytes


_BAD_PACKETS: Final = "packets that are no frames"


class _PcapngReader:
    """Parser of the blocks of one file.

    Args:
        name: name of the file.
        tally: counts of items that were not returned as frames, such as unreadable frames.
        marks: whether to return marks among the frames. The comment of a frame is a mark before the
            frame.
    """

    def __init__(self, name: str, tally: log_file.LogTally, marks: bool = False) -> None:
        self._name, self._tally, self._marks = name, tally, marks
        self._order, self._interfaces = "<", list[_Interface]()
        self._usual: _Usual | None = None
        self._idents: dict[bytes, tuple[int, bool]] = {}
        self._names: list[str] = []
        self._blocks, self._wanted, self._at_us, self._damage = 0, _READ_BYTES, 0, ""

    def frames(self, file: BinaryIO, begun: bytes) -> Iterator[Item]:
        """Yield the frames and marks of a pcapng capture.

        Args:
            file: open file.
            begun: bytes at the beginning of the file that were already read.

        Raises:
            LogError: the file is truncated or damaged. The frames before the damage are yielded
                first.
        """
        more, some = True, cast("BufferedReader", file).read1  # `read` loses the end of a cut log
        while more:
            data = some(self._wanted)
            begun += data
            records: list[Item] = []
            begun = begun[self._take(begun, records) :]
            yield from records
            more = bool(data) and not self._damage
        if begun:
            raise log_file.LogError(
                f"{self._name}: {self._damage or _CUT} after {self._blocks} blocks"
            )

    def _take(self, data: bytes, records: list[Item]) -> int:
        """Add the frames of the whole blocks. Return the start of the next block."""
        at, self._wanted = 0, _READ_BYTES
        while len(data) - (at := self._take_usual(data, at, records)) >= _BLOCK_BYTES:
            # A section may begin anywhere in a file, in the other byte order (files put one
            # behind the other).
            if data.startswith(_SECTION_BLOCK.to_bytes(4, "big"), at):
                self._begin(data[at + 8 : at + _BLOCK_BYTES])
            kind, size = struct.unpack_from(f"{self._order}II", data, at)
            rest = len(data) - at
            self._damage = self._damage or _damage_of(size, rest, data[at : at + size])
            if self._damage or rest < size:
                self._wanted = max(_READ_BYTES, size - rest)
                break
            self._take_block(kind, data[at + 8 : at + size - 4], records)
            self._blocks += 1
            at += size
        return at

    def _take_usual(self, data: bytes, at: int, records: list[Item]) -> int:
        """Read successive classic data frames without options.

        Nearly all blocks are of this kind.
        """
        usual, idents, names, at_us = self._usual, self._idents, self._names, -1
        if usual is None:
            return at
        layout, usual_head, usual_sizes, usual_tail = usual
        end = at + (len(data) - at) // _USUAL_BYTES * _USUAL_BYTES
        add, new, none, first = records.append, tuple.__new__, bytes(3), at
        for parts in layout.iter_unpack(memoryview(data)[at:end]):
            head, number, high, low, sizes, ident, length, flags, content, tail = parts
            # One comparison for each part that must be as usual; anything else goes the
            # slow way from here.
            if head != usual_head or sizes != usual_sizes or tail != usual_tail or flags != none:
                break
            known = idents.get(ident) or self._ident(ident)
            if known is None or length > can.MAX_DATA_BYTES or number >= len(names):
                break
            if high >= _END_HIGH:
                break
            at_us = high << 32 | low
            frame = new(can.CanFrame, (known[0], content[:length], False, known[1], 0))
            add(new(Record, (at_us, names[number], frame, False)))
            at += _USUAL_BYTES
        self._blocks += (at - first) // _USUAL_BYTES
        self._at_us = self._at_us if at_us < 0 else at_us
        return at

    def _ident(self, ident: bytes) -> tuple[int, bool] | None:
        """Return the identifier of a data frame and whether it is extended, or None for others."""
        frame = _parse_packet(ident + bytes(12))
        if not isinstance(frame, can.CanFrame) or frame.remote:
            return None
        known = self._idents[ident] = frame.can_id, frame.extended
        return known

    def _begin(self, magic: bytes) -> None:
        """Begin a section with its byte order."""
        orders = {_ORDER_MAGIC.to_bytes(4, "little"): "<", _ORDER_MAGIC.to_bytes(4, "big"): ">"}
        if magic not in orders:
            self._damage = f"it has a section of no byte order ({magic.hex()})"
        self._order = orders.get(magic, "<")
        self._interfaces, self._names, self._usual = [], [], None

    def _take_block(self, kind: int, content: bytes, records: list[Item]) -> None:
        order = self._order
        try:
            if kind == _INTERFACE_BLOCK:
                self._add_interface(content)
            elif kind == _PACKET_BLOCK:
                number, high, low, size, _ = struct.unpack_from(f"{order}5I", content)
                self._add(number, high << 32 | low, content[20:], size, records)
            elif kind == _OBSOLETE_PACKET:
                number, drops, high, low, size, _ = struct.unpack_from(f"{order}HH4I", content)
                # FFFFh in the obsolete packet block: not counted.
                self._drop(drops if drops < 0xFFFF else 0, records)
                self._add(number, high << 32 | low, content[20:], size, records)
            elif kind == _SIMPLE_PACKET:
                (size,) = struct.unpack_from(f"{order}I", content)
                snap = self._interfaces[0].snap_bytes if self._interfaces else 0
                self._tally.untimed += 1
                self._add(0, None, content[4:], min(size, snap or size), records)
            elif kind == _STATISTICS_BLOCK:
                self._comment(options(order, content[12:]), records)
        except struct.error:
            self._tally.pass_over(_BAD_PACKETS)

    def _add_interface(self, content: bytes) -> None:
        link_type, _, snap = struct.unpack_from(f"{self._order}HHI", content)
        told = dict(options(self._order, content[8:]))
        name = "_".join(told.get(_IF_NAME, b"").decode("utf-8", "replace").split())[:LONGEST_NAME]
        resolution = told.get(_TIME_RESOLUTION, b"\x06")[:1] or b"\x06"
        # if_tsresol: 6 is 10^-6 s, 89h is 2^-9 s; without it microseconds.
        power, binary = resolution[0] & 0x7F, resolution[0] & 0x80
        offset = told.get(_TIME_OFFSET, b"")
        offset_s = struct.unpack(f"{self._order}q", offset)[0] if len(offset) == 8 else 0
        self._interfaces.append(
            _Interface(
                name or f"can{len(self._interfaces)}",
                link_type == _LINK_TYPE,
                1 << power if binary else 10**power,
                offset_s * _MICROS,
                snap,
            )
        )
        self._names = [one.name for one in self._interfaces]
        plain = all(
            one.is_can and one.parts == _MICROS and not one.offset_us for one in self._interfaces
        )
        self._usual = _usual(self._order) if plain else None

    def _add(
        self, number: int, count: int | None, data: bytes, size: int, records: list[Item]
    ) -> None:
        """Add the frame of a packet.

        A packet without a time has the time of the previous packet.
        """
        if number >= len(self._interfaces) or size > len(data):
            self._tally.pass_over(_BAD_PACKETS)
            return
        where = self._interfaces[number]
        if not where.is_can:
            self._tally.pass_over(log_file.OTHER_PACKETS)
            return
        given = list(options(self._order, data[size + -size % 4 :]))
        byte_order: Literal["little", "big"] = "little" if self._order == "<" else "big"
        numbers = {code: int.from_bytes(value, byte_order) for code, value in given}
        if count is not None:
            self._at_us = max(0, count * _MICROS // where.parts + where.offset_us)
        self._drop(numbers.get(_DROP_COUNT, 0), records)
        self._comment(given, records)
        if self._at_us >= _END_US:
            self._tally.pass_over(log_file.NO_TIME)
            return
        frame = _parse_packet(data[:size])
        if frame is None or isinstance(frame, str):
            self._tally.pass_over(frame or _BAD_PACKETS)
            return
        sent = numbers.get(_PACKET_FLAGS, 0) & _DIRECTION
        records.append(Record(self._at_us, where.name, frame, sent == _OUTBOUND))

    def _drop(self, frames: int, records: list[Item]) -> None:
        """Count lost frames."""
        self._tally.lost += frames
        if frames and self._marks:
            records.append(log_file.dropped(self._at_us, frames))

    def _comment(self, given: Iterable[tuple[int, bytes]], records: list[Item]) -> None:
        """Add the marks in comments. A mark of lost frames also has a number."""
        if not self._marks:
            return
        texts = (value.decode("utf-8", "replace") for code, value in given if code == _COMMENT)
        marks = (log_file.read_mark(self._at_us, text) for text in texts)
        records += [mark for mark in marks if mark and mark.event != log_file.DROP]


def _damage_of(size: int, rest: int, block: bytes) -> str:
    """Return the fault of a block of which `present` bytes exist, empty if there is none."""
    if size < _BLOCK_BYTES or size % 4 or size > _MOST_BYTES:
        return f"it has a block of {size} bytes"
    return "it has a block whose sizes differ" if rest >= size and block[4:8] != block[-4:] else ""


def _usual(order: str) -> _Usual:
    sizes = struct.pack(f"{order}II", 16, 16)
    head = struct.pack(f"{order}II", _PACKET_BLOCK, _USUAL_BYTES)
    return _Usual(struct.Struct(f"{order}8s3I8s4sB3s8s4s"), head, sizes, head[4:])


# Frames in captures of Wireshark, tshark and tcpdump: pcapng, and pcap before it.
#
# The first bytes of a file show whether it is pcapng or pcap. The name does not matter.

_PCAP: Final = {
    bytes.fromhex("d4c3b2a1"): ("<", 1),
    bytes.fromhex("a1b2c3d4"): (">", 1),
    bytes.fromhex("4d3cb2a1"): ("<", 1_000),
    bytes.fromhex("a1b23c4d"): (">", 1_000),
}
"""First bytes of a pcap file, which define byte order and fractions of a second per microsecond."""

_HEAD_BYTES: Final = 24
_LINK_TYPE_AT: Final = 20


class PcapReader:
    """A reader of the frames in a capture."""

    def __init__(self, path: Path, kind: log_file.LogFormat) -> None:
        self._path, self.tally = path, log_file.LogTally()

    def __iter__(self) -> Iterator[Record]:
        """Read the file."""
        return cast("Iterator[Record]", self._items(marks=False))

    def items(self) -> Iterator[Item]:
        """Read the file, with the marks among its frames."""
        return self._items(marks=True)

    def _items(self, *, marks: bool) -> Iterator[Item]:
        self.tally = log_file.LogTally()
        try:
            with log_file.open_log(self._path) as file:
                yield from self._frames(file, marks)
        except (EOFError, zlib.error, OSError) as error:
            if isinstance(error, OSError) and error.errno is not None:
                raise
            raise log_file.LogError(f"{self._path}: {error}") from error

    def _frames(self, file: BinaryIO, marks: bool) -> Iterator[Item]:
        first = file.read(4)
        if first == _SECTION_BLOCK.to_bytes(4, "little"):
            yield from _PcapngReader(str(self._path), self.tally, marks).frames(file, first)
        elif first in _PCAP:
            yield from self._packets(file, *_PCAP[first])
        else:
            raise log_file.LogError(
                f"{self._path} is no capture: it begins with {first.hex() or 'nothing'}"
            )

    def _packets(self, file: BinaryIO, order: str, parts: int) -> Iterator[Record]:
        """Yield the frames of a pcap file, which does not name buses."""
        head = file.read(_HEAD_BYTES - 4)
        if len(head) < _HEAD_BYTES - 4:
            raise log_file.LogError(f"{self._path}: it is cut in its header")
        (link_type,) = struct.unpack_from(f"{order}I", head, _LINK_TYPE_AT - 4)
        # Seconds, fraction, bytes that are here, bytes that were on the wire.
        heading, count = struct.Struct(f"{order}4I"), 0
        while begun := file.read(heading.size):
            size = heading.unpack(begun)[2] if len(begun) == heading.size else 0
            if size > _MOST_BYTES:
                raise log_file.LogError(
                    f"{self._path}: a packet of {size} bytes behind {count} packets"
                )
            data = file.read(size)
            if len(begun) < heading.size or len(data) < size:
                raise log_file.LogError(f"{self._path}: it is cut after {count} packets")
            count += 1
            seconds, fraction, _, _ = heading.unpack(begun)
            # Above 16 bits pcap keeps the length of a frame check sequence.
            if link_type & 0xFFFF != _LINK_TYPE:
                self.tally.pass_over(log_file.OTHER_PACKETS)
                continue
            frame = _parse_packet(data)
            if frame is None or isinstance(frame, str):
                self.tally.pass_over(frame or _BAD_PACKETS)
            else:
                yield Record(seconds * 1_000_000 + fraction // parts, UNNAMED, frame)


# Frames into a pcapng file, as Wireshark writes it (draft-ietf-opsawg-pcapng).
#
# A section in little-endian order, an interface for each bus, an enhanced packet for each frame.

_SECTION: Final = struct.Struct("<IHHq")
_INTERFACE: Final = struct.Struct("<HHI")
_PACKET: Final = struct.Struct("<IIIII")
_STATISTICS: Final = struct.Struct("<III")
_USUAL: Final = struct.Struct("<7IIB3x8sI")
_USUAL_BLOCK_BYTES: Final = _USUAL.size
_LOW: Final = 0xFFFF_FFFF
_BLOCK_FRAMES: Final = 256


class PcapngWriter:
    """Writer of a pcapng capture for Wireshark. A mark becomes a comment of the frame after it.

    Raises:
        LogError: the name of the file ends in `.pcap`. That older format does not name its buses,
            so it is not written.
        OSError: the file cannot be written.
    """

    def __init__(self, path: Path, kind: log_file.LogFormat) -> None:
        log_file.check_written(path, kind)
        self._file, self._blocks = log_file.open_log(path, "wb"), list[bytes]()
        self._interfaces: dict[str, int] = {}
        self._options = self._comments = b""  # of the frame that comes next
        self._at_us = 0
        content = _SECTION.pack(_ORDER_MAGIC, 1, 0, -1)
        self._blocks.append(
            _block(_SECTION_BLOCK, content + _option(_APPLICATION, b"tickrig canmon") + _END)
        )

    def write(self, record: Record, /) -> None:
        """Add a frame."""
        at_us, channel, frame, sent = record
        number = self._interfaces.get(channel)
        if number is None:
            number = self._begin(channel)
        if isinstance(frame, can.CanFrame) and not (sent or self._comments or frame.remote):
            # without the steps below: as quick as a line of candump
            size, length = _USUAL_BLOCK_BYTES, len(frame.data)
            ident = frame.can_id | EXTENDED if frame.extended else frame.can_id
            self._blocks.append(
                _USUAL.pack(
                    *(_PACKET_BLOCK, size, number, at_us >> 32, at_us & _LOW, _CLASSIC_BYTES),
                    *(_CLASSIC_BYTES, _swapped(ident), length, frame.data, size),
                )
            )
        else:
            self._add(at_us, number, packet(frame), sent)
        self._at_us = at_us
        if len(self._blocks) >= _BLOCK_FRAMES:
            self._give()

    def mark(self, mark: log_file.Mark, /) -> None:
        """Add a mark to the next frame. For lost frames, also add their number."""
        if mark.event == log_file.DROP:
            self._options += _option(_DROP_COUNT, struct.pack("<Q", mark.frames))
        self._comments += _option(_COMMENT, mark.text.encode())

    def flush(self) -> None:
        """Pass all items to the operating system."""
        self._give()
        self._file.flush()

    def close(self) -> None:
        """Complete the capture.

        A mark is an event among the frames, such as lost frames. Marks after the last frame are
        stored as comments in the statistics block of the first bus.
        """
        if self._file.closed:
            return
        with self._file:
            if self._comments and self._interfaces:
                content = _STATISTICS.pack(0, self._at_us >> 32, self._at_us & _LOW)
                self._blocks.append(_block(_STATISTICS_BLOCK, content + self._comments + _END))
            self._give()

    def messages(self) -> list[str]:
        """Return no messages, because a capture holds all items."""
        return []

    def _begin(self, channel: str) -> int:
        options = _option(_IF_NAME, channel.encode()) + _option(_TIME_RESOLUTION, b"\x06") + _END
        self._blocks.append(_block(_INTERFACE_BLOCK, _INTERFACE.pack(_LINK_TYPE, 0, 0) + options))
        number = self._interfaces[channel] = len(self._interfaces)
        return number

    def _add(self, at_us: int, number: int, data: bytes, sent: bool) -> None:
        options = self._options + self._comments
        self._options = self._comments = b""
        if sent:
            options = _option(_PACKET_FLAGS, struct.pack("<I", _OUTBOUND)) + options
        head = _PACKET.pack(number, at_us >> 32, at_us & _LOW, len(data), len(data))
        self._blocks.append(
            _block(_PACKET_BLOCK, head + data + (options + _END if options else b""))
        )

    def _give(self) -> None:
        self._file.write(b"".join(self._blocks))
        self._blocks.clear()


def _swapped(number: int) -> int:
    """Return a number whose little-endian bytes are those of another number in network order."""
    return int.from_bytes(number.to_bytes(4, "big"), "little")
