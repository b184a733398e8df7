"""Objects of a BLF log, a container at a time; needs numpy."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from tickrig.host.canmon.model.columns.columns import ChannelNames, Rows
from tickrig.host.canmon.model.frames import EXTENDED, REMOTE
from tickrig.host.canmon.model.logs import can_log
from tickrig.host.canmon.model.logs.log_file import END_S
from tickrig.wire.can import EXTENDED_MAX, MAX_DATA_BYTES, STANDARD_MAX

# An object is a header of 16 bytes, a second header of 16 or 24, by its version, and a body:
#
#     0 "LOBJ"   4 size of both headers   6 version   8 size   12 type
#     16 flags   24 time stamp
#     32 or 40   channel (2), flags, length code, CAN-ID (4), data (8): a frame
#
# All signatures are found at once. Each is followed to the first that is behind its object: if
# that is always the next one, no signature stands among data. A field is then read of all objects
# together, as words at any address. What python-can would read in another way (a frame of CAN FD,
# an error frame, a size that does not fit) makes the container one for the reader of frames.

_FRAMES: Final = (1, 86)
"""CAN_MESSAGE, CAN_MESSAGE2."""

_SIGNATURE: Final = int.from_bytes(b"LOBJ", "little")
_PADDED: Final = 4
"""An object begins at most so far behind the end of the one before."""
_SEARCHED: Final = 8

_HEADERS: Final = (32, 40)
"""Bytes of both headers, by their version, from 1."""
_BODY: Final = 16
_IN_10_US: Final = 1
_SENT, _REMOTE_FRAME = 0x01, 0x80
_EXACT: Final = 1 << 53
"""Below it a stamp is exact as a floating-point number."""

_PLAIN, _FRAME, _NOTE, _ODD = range(4)
_KINDS: Final = np.full(256, _PLAIN, np.uint8)
"""What an object is, by its type; the last entry is of all beyond."""
_KINDS[list(_FRAMES)], _KINDS[list(can_log.BLF_NOTES)], _KINDS[list(can_log.BLF_FRAMES)] = (
    _FRAME,
    _NOTE,
    _ODD,
)

_Places = npt.NDArray[np.int64]


class _Objects:
    """Objects of which any field can be read of all together.

    Args:
        data: where they are.
        places: where each begins.
        stride: how far each is behind the one before, where that is the same for all: a field
            is then a view, which takes a fifth of the time of picking it up.
    """

    def __init__(self, data: bytes, places: _Places, stride: int = 0) -> None:
        self.data, self.places, self._stride = data, places, stride

    def field(self, code: str, offset: int) -> npt.NDArray[Any]:
        """Return the numbers at a place behind the beginning of each object."""
        if self._stride:
            begin = int(self.places[0]) + offset
            shape, strides = (len(self.places),), (self._stride,)
            return np.ndarray(shape, code, self.data, begin, strides)
        size = np.dtype(code).itemsize
        return np.ndarray((len(self.data) - size + 1,), code, self.data, 0, (1,))[
            self.places + offset
        ]

    def select(self, rows: _Places) -> _Objects:
        """Return some of them."""
        whole = len(rows) == len(self.places)
        return self if whole else _Objects(self.data, self.places[rows])


class BlfBlocks:
    """Takes containers apart; called with their contents and the time of the beginning in s."""

    def __init__(self, channels: ChannelNames) -> None:
        self._channels = channels

    def __call__(self, data: bytes, start_s: float) -> can_log.BlfBlock | None:
        """Return the frames; None where they are to be read one by one."""
        found = _alike(data) or _aligned(data) or _anywhere(data)
        if found is None:
            return None
        sizes, versions = found.field("<u4", 8), found.field("<u2", 6)
        kinds = _KINDS[np.minimum(found.field("<u4", 12), len(_KINDS) - 1)]
        if (
            ((versions - np.uint16(1)) > 1).any()
            or sizes.min() < _HEADERS[1]
            or kinds.max() == _ODD
        ):
            return None
        notes = np.flatnonzero(kinds == _NOTE)
        told = zip(*(part[notes].tolist() for part in (found.places, sizes)), strict=True)
        types = found.field("<u4", 12)[notes].tolist()
        end = int(found.places[-1]) + int(sizes[-1])
        rows = self._rows(found.select(np.flatnonzero(kinds == _FRAME)), start_s)
        if rows is None:
            return None
        noted = [(*one, kind) for one, kind in zip(told, types, strict=True)]
        return can_log.BlfBlock(rows, len(rows.known), noted, end)

    def _rows(self, frames: _Objects, start_s: float) -> Rows | None:
        """Return a row for each frame; None where one is not as usual."""
        rows = Rows(len(frames.places))
        if not len(frames.places):
            return rows
        versions, stamps = frames.field("<u2", 6), frames.field("<u8", 24)
        body = _HEADERS[int(versions[0]) - 1]
        if versions.min() != versions.max() or frames.field("<u4", 8).min() < body + _BODY:
            return None
        # as python-can computes it: its decimal product is exact, so the quotient is rounded alike
        in_10_us = frames.field("<u4", 16) == _IN_10_US
        seconds = stamps / (np.where(in_10_us, 1e5, 1e9) if in_10_us.any() else 1e9) + start_s
        flags, dlc = frames.field("u1", body + 2), frames.field("u1", body + 3)
        if stamps.max() >= _EXACT or seconds.min() < 0 or seconds.max() >= END_S:
            return None
        if dlc.max() > MAX_DATA_BYTES:
            return None
        rows.at_us[:] = np.rint(seconds * 1e6)
        told = frames.field("<u4", body + 4)
        ident, remote = told & np.uint32(EXTENDED_MAX), flags & _REMOTE_FRAME != 0
        rows.ident[:] = ident
        rows.ident[(told & np.uint32(EXTENDED) != 0) | (ident > STANDARD_MAX)] |= EXTENDED
        rows.ident[remote] |= REMOTE
        rows.dlc[:], rows.sent[:], rows.known[:] = dlc, flags & _SENT != 0, True
        rows.payload[:] = frames.field("<u8", body + 8) & _MASKS[dlc]
        rows.payload[remote] = 0
        numbers = frames.field("<u2", body)
        for number in np.flatnonzero(np.bincount(numbers)).tolist():
            rows.channel[numbers == number] = self._channels.place(can_log.channel_name(number - 1))
        return rows


_MASKS: Final = np.array([(1 << 8 * count) - 1 for count in range(9)], np.uint64)
"""Words of which the first bytes are wanted."""


def _alike(data: bytes) -> _Objects | None:
    """Return the objects where all have the size of the first, as python-can writes them."""
    if len(data) < 2 * can_log.OBJECT_BYTES:
        return None
    size = int.from_bytes(data[8:12], "little")
    if size < can_log.OBJECT_BYTES or len(data) < size:
        return None
    count, rest = divmod(len(data), size)
    found = _Objects(data, np.arange(count) * size, size)
    if (found.field("<u4", 0) != _SIGNATURE).any() or (found.field("<u4", 8) != size).any():
        return None
    if rest < _SEARCHED:
        return found
    head = data[count * size : count * size + can_log.OBJECT_BYTES]
    cut = head[:4] == b"LOBJ" and int.from_bytes(head[8:12], "little") > rest
    return found if cut and len(head) == can_log.OBJECT_BYTES else None


def _aligned(data: bytes) -> _Objects | None:
    """Return the objects where each begins at the end of the one before, at a multiple of four.

    That is how logs are written; it saves two thirds of the time of looking at each byte.
    """
    words = np.frombuffer(data, "<u4", len(data) >> 2)
    places = np.flatnonzero(words == _SIGNATURE) * 4
    return None if not len(places) or places[0] else _whole(data, places, 0)


def _anywhere(data: bytes) -> _Objects | None:
    """Return the objects with the padding that python-can passes over."""
    if len(data) < can_log.OBJECT_BYTES:
        return None
    words = np.ndarray((len(data) - 3,), "<u4", data, 0, (1,))
    places = np.flatnonzero(words == _SIGNATURE)
    return _whole(data, places, _PADDED) if len(places) and places[0] <= _PADDED else None


def _whole(data: bytes, places: _Places, padded: int) -> _Objects | None:
    """Return the objects that are whole; None where what is behind one is unclear.

    Args:
        data: where they are.
        places: of all signatures, the first one being that of an object.
        padded: bytes that may be between two objects.
    """
    places = places[places <= len(data) - can_log.OBJECT_BYTES]
    ends = places + _Objects(data, places).field("<u4", 8)
    rows = _chain(places, ends, len(data), padded)
    return None if rows is None else _Objects(data, places[rows])


def _chain(places: _Places, ends: _Places, length: int, padded: int) -> _Places | None:
    """Return which signatures begin whole objects, one behind the other; None if that is unclear.

    Args:
        places: of all signatures.
        ends: where the object of each would end.
        length: of the data.
        padded: bytes that may be between two objects.
    """
    if not len(places) or (ends - places < can_log.OBJECT_BYTES).any():
        return None
    behind = np.searchsorted(places, ends)
    count = len(places)
    if (behind[:-1] == np.arange(1, count)).all():
        rows = np.arange(count)
    else:
        following, chain, at = behind.tolist(), list[int](), 0
        while at < count:
            chain.append(at)
            at = following[at]
        rows = np.array(chain)
    gaps = places[rows][1:] - ends[rows][:-1]
    if (gaps > padded).any():
        return None
    if ends[rows[-1]] > length:
        rows = rows[:-1]
    elif ends[rows[-1]] + _SEARCHED <= length:
        return None
    return rows if len(rows) else None
