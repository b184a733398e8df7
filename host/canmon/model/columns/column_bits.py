"""The length of many CAN frames on the bus at once, as `frame_bits` has it; needs numpy."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from tickrig.host.canmon.model.frames import REMOTE
from tickrig.wire import can

_BLOCK: Final = 1 << 14
"""Frames at a time: what is computed of them stays in the cache."""

_HEAD_BYTES: Final = (3, 5)
"""Bytes in front of the data, 11-bit and 29-bit."""

_Ints = npt.NDArray[np.int64]

_NEXT: Final = np.array(can.NEXT, np.int64)
_STUFFED: Final = np.array(can.STUFFED, np.int64)


def column_bits(
    ident: npt.NDArray[np.uint32], dlc: npt.NDArray[np.uint8], payload: npt.NDArray[np.uint64]
) -> _Ints:
    """Return the bits of each frame with stuff bits and interframe space.

    Args:
        ident: see `ident_of`.
        dlc: data length codes; of a remote frame too.
        payload: bytes as a little-endian number, 0 for those that are not there.
    """
    out = np.empty(len(ident), np.int64)
    for begin in range(0, len(ident), _BLOCK):
        part = slice(begin, begin + _BLOCK)
        out[part] = _block(ident[part].astype(np.int64), dlc[part].astype(np.int64), payload[part])
    return out


def _block(ident: _Ints, dlc: _Ints, payload: npt.NDArray[np.uint64]) -> _Ints:
    lengths = np.where(ident & REMOTE, 0, dlc)
    forms = (ident >> 31) * (can.MAX_DATA_BYTES + 1) + lengths
    out = np.empty(len(ident), np.int64)
    for form in np.flatnonzero(np.bincount(forms)):
        extended, length = divmod(int(form), can.MAX_DATA_BYTES + 1)
        rows = np.flatnonzero(forms == form)
        heads = _heads(ident[rows], dlc[rows], bool(extended))
        out[rows] = _same_form(heads, payload[rows], bool(extended), length)
    return out


def _heads(ident: _Ints, dlc: _Ints, extended: bool) -> _Ints:
    control = (ident & REMOTE) >> 24 | dlc
    can_id = ident & can.EXTENDED_MAX
    if extended:
        can_id = (can_id >> 18) << 20 | can.EXTENDED_FLAGS << 18 | can_id & 0x3_FFFF
    return can_id << 7 | control


def _same_form(heads: _Ints, payload: npt.NDArray[np.uint64], extended: bool, length: int) -> _Ints:
    head_bytes = _HEAD_BYTES[extended]
    columns = [heads >> 8 * place & 0xFF for place in reversed(range(head_bytes))]
    octets = payload.astype("<u8").view(np.uint8).reshape(-1, 8)
    columns += [octets[:, place].astype(np.int64) for place in range(length)]
    crc = np.zeros(len(heads), np.int64)
    for column, table in zip(columns, _crc_tables(len(columns)), strict=True):
        crc ^= table[column]
    crc |= ~crc >> 1 & 1
    return _feed([*columns, crc >> 8, crc & 0xFF], extended) + 8 * length


def _feed(columns: list[_Ints], extended: bool) -> _Ints:
    """Run the stuffing automaton over each frame."""
    state = np.full(len(columns[0]), (can.START_EXTENDED if extended else can.START_STANDARD) << 8)
    bits = np.full(len(columns[0]), can.EXTENDED_BITS if extended else can.STANDARD_BITS)
    for column in columns:
        state += column
        bits += _STUFFED[state]
        state = _NEXT[state]
    return bits


@lru_cache
def _crc_tables(length: int) -> tuple[_Ints, ...]:
    """Return a table for each byte of a stream; the CRC is linear, so what they give is xored."""
    return tuple(
        np.array([can.crc16(bytes([byte]) + bytes(behind)) for byte in range(256)], np.int64)
        for behind in reversed(range(length))
    )
