"""The frames in a pcapng file (draft-ietf-opsawg-pcapng), in either byte order.

Read are sections, interfaces, and packets in enhanced, simple and the obsolete blocks; others
are passed over. Times of any resolution are cut to microseconds.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from io import BufferedReader
from typing import BinaryIO, Final, NamedTuple, cast

from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.logs.log_file import END_S, LogError
from tickrig.host.canmon.model.logs.log_reader import Item
from tickrig.host.canmon.model.logs.mark import DROP, dropped, read_mark
from tickrig.host.canmon.model.logs.notation import LONGEST_NAME
from tickrig.host.canmon.model.logs.pcap.block_format import (
    BLOCK_BYTES,
    COMMENT,
    DIRECTION,
    DROP_COUNT,
    IF_NAME,
    INTERFACE,
    OBSOLETE_PACKET,
    ORDER_MAGIC,
    OUTBOUND,
    PACKET,
    PACKET_FLAGS,
    SECTION,
    SIMPLE_PACKET,
    STATISTICS,
    TIME_OFFSET,
    TIME_RESOLUTION,
    options,
)
from tickrig.host.canmon.model.logs.pcap.can_packet import LINK_TYPE, parse_packet
from tickrig.host.canmon.model.logs.tally import BAD_PACKETS, NO_TIME, OTHER_PACKETS, Tally
from tickrig.wire.can import MAX_DATA_BYTES, CanFrame

MOST_BYTES: Final = 1 << 24
"""Of a block: more is damage."""

CUT: Final = "it is cut"
_READ_BYTES: Final = 1 << 16
_MICROS: Final = 1_000_000
_USUAL_BYTES: Final = 48
_END_US: Final = END_S * _MICROS
_END_HIGH: Final = _END_US >> 32


class Interface(NamedTuple):
    """Where packets were captured.

    Attributes:
        name: of the bus.
        is_can: its packets are frames.
        parts: parts of a second that its times count.
        offset_us: what is added to them.
        snap_bytes: packets are cut to so many; 0 for no limit.
    """

    name: str
    is_can: bool
    parts: int
    offset_us: int
    snap_bytes: int


class _Usual(NamedTuple):
    """How a block with a classic data frame without options is taken apart, and what it has."""

    layout: struct.Struct
    head: bytes
    sizes: bytes
    tail: bytes


class PcapngReader:
    """Takes blocks apart, one file.

    Args:
        name: what the file is called.
        tally: takes what is no frame.
        marks: give marks among the frames, too: a comment of a frame is in front of it.
    """

    def __init__(self, name: str, tally: Tally, marks: bool = False) -> None:
        self._name, self._tally, self._marks = name, tally, marks
        self._order, self._interfaces = "<", list[Interface]()
        self._usual: _Usual | None = None
        self._idents: dict[bytes, tuple[int, bool]] = {}
        self._names: list[str] = []
        self._blocks, self._wanted, self._at_us, self._damage = 0, _READ_BYTES, 0, ""

    def frames(self, file: BinaryIO, begun: bytes) -> Iterator[Item]:
        """Yield frames.

        Args:
            file: the file.
            begun: what was read of it.

        Raises:
            LogError: it is cut or damaged, after all frames before that.
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
            raise LogError(f"{self._name}: {self._damage or CUT} after {self._blocks} blocks")

    def _take(self, data: bytes, records: list[Item]) -> int:
        """Add the frames of the blocks that are whole; return where the next one begins."""
        at, self._wanted = 0, _READ_BYTES
        while len(data) - (at := self._take_usual(data, at, records)) >= BLOCK_BYTES:
            if data.startswith(SECTION.to_bytes(4, "big"), at):
                self._begin(data[at + 8 : at + BLOCK_BYTES])
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
        """Take classic data frames without options that follow each other: nearly all are so."""
        usual, idents, names, at_us = self._usual, self._idents, self._names, -1
        if usual is None:
            return at
        layout, usual_head, usual_sizes, usual_tail = usual
        end = at + (len(data) - at) // _USUAL_BYTES * _USUAL_BYTES
        add, new, none, first = records.append, tuple.__new__, bytes(3), at
        for parts in layout.iter_unpack(memoryview(data)[at:end]):
            head, number, high, low, sizes, ident, length, flags, content, tail = parts
            if head != usual_head or sizes != usual_sizes or tail != usual_tail or flags != none:
                break
            known = idents.get(ident) or self._ident(ident)
            if known is None or length > MAX_DATA_BYTES or number >= len(names):
                break
            if high >= _END_HIGH:
                break
            at_us = high << 32 | low
            frame = new(CanFrame, (known[0], content[:length], False, known[1], 0))
            add(new(Record, (at_us, names[number], frame, False)))
            at += _USUAL_BYTES
        self._blocks += (at - first) // _USUAL_BYTES
        self._at_us = self._at_us if at_us < 0 else at_us
        return at

    def _ident(self, ident: bytes) -> tuple[int, bool] | None:
        """Return the identifier of a data frame, and whether it is extended; None for others."""
        frame = parse_packet(ident + bytes(12))
        if not isinstance(frame, CanFrame) or frame.remote:
            return None
        known = self._idents[ident] = frame.can_id, frame.extended
        return known

    def _begin(self, magic: bytes) -> None:
        """Begin a section, in its byte order."""
        orders = {ORDER_MAGIC.to_bytes(4, "little"): "<", ORDER_MAGIC.to_bytes(4, "big"): ">"}
        if magic not in orders:
            self._damage = f"it has a section of no byte order ({magic.hex()})"
        self._order = orders.get(magic, "<")
        self._interfaces, self._names, self._usual = [], [], None

    def _take_block(self, kind: int, content: bytes, records: list[Item]) -> None:
        order = self._order
        try:
            if kind == INTERFACE:
                self._add_interface(content)
            elif kind == PACKET:
                number, high, low, size, _ = struct.unpack_from(f"{order}5I", content)
                self._add(number, high << 32 | low, content[20:], size, records)
            elif kind == OBSOLETE_PACKET:
                number, drops, high, low, size, _ = struct.unpack_from(f"{order}HH4I", content)
                self._drop(drops if drops < 0xFFFF else 0, records)
                self._add(number, high << 32 | low, content[20:], size, records)
            elif kind == SIMPLE_PACKET:
                (size,) = struct.unpack_from(f"{order}I", content)
                snap = self._interfaces[0].snap_bytes if self._interfaces else 0
                self._tally.untimed += 1
                self._add(0, None, content[4:], min(size, snap or size), records)
            elif kind == STATISTICS:
                self._comment(options(order, content[12:]), records)
        except struct.error:
            self._tally.passed_over[BAD_PACKETS] += 1

    def _add_interface(self, content: bytes) -> None:
        link_type, _, snap = struct.unpack_from(f"{self._order}HHI", content)
        told = dict(options(self._order, content[8:]))
        name = "_".join(told.get(IF_NAME, b"").decode("utf-8", "replace").split())[:LONGEST_NAME]
        resolution = told.get(TIME_RESOLUTION, b"\x06")[:1] or b"\x06"
        power, binary = resolution[0] & 0x7F, resolution[0] & 0x80
        offset = told.get(TIME_OFFSET, b"")
        offset_s = struct.unpack(f"{self._order}q", offset)[0] if len(offset) == 8 else 0
        self._interfaces.append(
            Interface(
                name or f"can{len(self._interfaces)}",
                link_type == LINK_TYPE,
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
        """Add the frame of a packet; without a time it has that of the packet before."""
        if number >= len(self._interfaces) or size > len(data):
            self._tally.passed_over[BAD_PACKETS] += 1
            return
        where = self._interfaces[number]
        if not where.is_can:
            self._tally.passed_over[OTHER_PACKETS] += 1
            return
        told = dict(options(self._order, data[size + -size % 4 :]))
        drops = int.from_bytes(told.get(DROP_COUNT, b""), "little" if self._order == "<" else "big")
        if count is not None:
            self._at_us = max(0, count * _MICROS // where.parts + where.offset_us)
        self._drop(drops, records)
        self._comment(options(self._order, data[size + -size % 4 :]), records)
        if self._at_us >= _END_US:
            self._tally.passed_over[NO_TIME] += 1
            return
        frame = parse_packet(data[:size])
        if frame is None or isinstance(frame, str):
            self._tally.passed_over[frame or BAD_PACKETS] += 1
            return
        flags = told.get(PACKET_FLAGS, b"")
        sent = int.from_bytes(flags, "little" if self._order == "<" else "big") & DIRECTION
        records.append(Record(self._at_us, where.name, frame, sent == OUTBOUND))

    def _drop(self, frames: int, records: list[Item]) -> None:
        """Count frames that were lost."""
        self._tally.lost += frames
        if frames and self._marks:
            records.append(dropped(self._at_us, frames))

    def _comment(self, given: Iterator[tuple[int, bytes]], records: list[Item]) -> None:
        """Add the marks that comments are; frames that were lost have a number, too."""
        if not self._marks:
            return
        texts = (value.decode("utf-8", "replace") for code, value in given if code == COMMENT)
        marks = (read_mark(self._at_us, text) for text in texts)
        records += [mark for mark in marks if mark and mark.event != DROP]


def _damage_of(size: int, rest: int, block: bytes) -> str:
    """Say what is wrong with a block of which so many bytes are there; empty if nothing is."""
    if size < BLOCK_BYTES or size % 4 or size > MOST_BYTES:
        return f"it has a block of {size} bytes"
    return "it has a block whose sizes differ" if rest >= size and block[4:8] != block[-4:] else ""


def _usual(order: str) -> _Usual:
    sizes = struct.pack(f"{order}II", 16, 16)
    head = struct.pack(f"{order}II", PACKET, _USUAL_BYTES)
    return _Usual(struct.Struct(f"{order}8s3I8s4sB3s8s4s"), head, sizes, head[4:])
