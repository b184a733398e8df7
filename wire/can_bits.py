"""The length of a classic CAN frame on the bus, to the bit.

A node sends the bit stream from start of frame to the end of the CRC with bit
stuffing: after five equal bits one of the other value is inserted, and it
counts as the first of the next run (ISO 11898-1, bit stuffing). What follows
has a fixed form: CRC delimiter, ACK slot, ACK delimiter, seven bits end of
frame and three bits interframe space.

>>> frame_bits(CanFrame.parse("705#7F")), frame_bits(CanFrame.parse("000#"))
(58, 53)
"""

from __future__ import annotations

from functools import lru_cache, reduce
from operator import getitem
from typing import Any, Final

import crcmod

from tickrig.wire.can import CanFrame

INTERFRAME_BITS: Final = 3
"""Bits of the interframe space (intermission), included in `frame_bits`."""

CRC_POLYNOMIAL: Final = 0x4599
"""x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1 (ISO 11898-1)."""

# The generator times x: the CRC of 15 bits stands in the upper bits of 16, and
# bytes can be fed. Zeros in front of a stream change nothing: the seed is 0.
_crc16 = crcmod.mkCrcFun(1 << 16 | CRC_POLYNOMIAL << 1, initCrc=0, rev=False, xorOut=0)

STANDARD_BITS: Final = 1 + 11 + 3 + 4 + 15 + 10 + INTERFRAME_BITS
EXTENDED_BITS: Final = STANDARD_BITS + 20
"""Bits of an empty frame without stuff bits."""
EXTENDED_FLAGS: Final = 0b11  # SRR and IDE, both recessive

# States of the stuffing automaton: value of the latest bit << 2 | length of its
# run - 1; a run of five is broken at once. Two more states begin a frame: they
# skip the zeros that fill its first byte up.
START_STANDARD: Final = 8
START_EXTENDED: Final = 9
_FILL_BITS: Final = {START_STANDARD: 5, START_EXTENDED: 1}
STATES: Final = 10

MAX_STUFFED: Final = 29
"""Of the 118 bits from start of frame to the end of the CRC: all but the first of each fifth."""

STUFFED_BITS: Final = 256
"""Place in a row of the number of stuff bits so far; before it stand the rows that follow."""

KEPT_HEADS: Final = 4_096

_Row = list[Any]

_heads: Final[dict[int, tuple[int, _Row, int]]] = {}
"""What was begun before: a plain table, for `lru_cache` keeps an order of use that costs 1 %."""


def frame_bits(frame: CanFrame) -> int:
    """Return the bits of a frame with stuff bits and interframe space."""
    data = frame[1]  # places, not names: all five at once would take longer than these
    key = frame[0] << 6 | len(data)
    if frame[2] or frame[3]:
        key |= frame[3] << 5 | frame[2] << 4 | frame[4]
    bits, row, crc = _heads.get(key) or _head(key)
    crc = _crc16(data, crc)
    row = reduce(getitem, data, row)
    # Behind the CRC a bit unlike its last one: it fills the byte up, and is never stuffed.
    end: int = row[crc >> 8][crc & 0xFE | ~crc >> 1 & 1][STUFFED_BITS]
    return bits + end


def _head(key: int) -> tuple[int, _Row, int]:
    """Begin a frame: its bits without stuff bits, and row and CRC behind the DLC."""
    can_id, extended, remote, length = key >> 6, key >> 5 & 1, key >> 4 & 1, key & 0xF
    control = remote << 6 | length
    if extended:
        arbitration = (can_id >> 18) << 20 | EXTENDED_FLAGS << 18 | can_id & 0x3_FFFF
        stream, bits = (arbitration << 7 | control).to_bytes(5, "big"), EXTENDED_BITS
    else:
        stream, bits = (can_id << 7 | control).to_bytes(3, "big"), STANDARD_BITS
    first = _rows()[START_EXTENDED if extended else START_STANDARD]
    data_bits = 0 if remote else 8 * length
    if len(_heads) >= KEPT_HEADS:
        _heads.clear()
    head = bits + data_bits, reduce(getitem, stream, first), _crc16(stream)
    _heads[key] = head
    return head


@lru_cache(1)
def _rows() -> list[_Row]:
    """Lay the automaton out, so that bytes are followed without a step of Python for each.

    Returns:
        By the state in which a frame begins: by each byte what follows it, and so on; at
        `STUFFED_BITS` how many bits were stuffed on the way there.
    """
    steps = [stuffed * STATES + (state >> 8) for stuffed, state in zip(STUFFED, NEXT, strict=True)]
    rows: list[_Row] = [[] for _ in range(STATES * (MAX_STUFFED + 1) + max(steps))]
    for stuffed in range(MAX_STUFFED + 1):
        first = stuffed * STATES
        for state in range(STATES):
            row = rows[first + state]
            row += [rows[first + step] for step in steps[state << 8 : state + 1 << 8]]
            row.append(stuffed)
    return rows


def crc16(stream: bytes) -> int:
    """Return the CRC of a bit stream, times two.

    >>> crc16(bytes([1])) == CRC_POLYNOMIAL << 1
    True
    """
    crc: int = _crc16(stream)
    return crc


def _feed(state: int, byte: int) -> tuple[int, int]:
    """Return the state after eight more bits, and how many bits were stuffed."""
    fill = _FILL_BITS.get(state, 0)
    last, run = (None, 0) if fill else (state >> 2, (state & 3) + 1)
    stuffed = 0
    for place in reversed(range(8 - fill)):
        bit = byte >> place & 1
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            last, run, stuffed = 1 - bit, 1, stuffed + 1
    return (last or 0) << 2 | run - 1, stuffed


_FED: Final = tuple(_feed(state, byte) for state in range(STATES) for byte in range(256))
NEXT: Final = tuple(state << 8 for state, _ in _FED)
"""By state << 8 | byte: the state after it << 8."""
STUFFED: Final = tuple(stuffed for _, stuffed in _FED)
"""By state << 8 | byte: how many bits are stuffed."""
