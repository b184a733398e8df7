"""What frames in columns mean, as frame by frame; needs numpy."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from tickrig.host.canmon.model.columns.columns import Columns, Ints, by_channel, records, select
from tickrig.host.canmon.model.decode.bus_decoder import BusDecoder, Effect
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_board import NodeBoard
from tickrig.host.canmon.model.frames import ERROR, EXTENDED, REMOTE, Record
from tickrig.wire.can import STANDARD_MAX

# The node board of a log in blocks: only frames that can change it are decoded; needs numpy.

_PIECE: Final = 1 << 10
"""Frames in Python at once."""


class ColumnNodes:
    """Feeds a node board with blocks; what it shows at their end is as frame by frame.

    Of `NodeStatus.pdos`, which the verb does not show, only those that matter to it are there.

    Args:
        decoder: it must be `standard`.
        board: fed by nobody else.
    """

    def __init__(self, decoder: Decoder, board: NodeBoard) -> None:
        self._decoder, self._board, self._begun = decoder, board, False

    def take(self, columns: Columns) -> None:
        """Take a block of frames."""
        if not len(columns):
            return
        if not self._begun:  # nodes with an EDS are on the bus of the very first frame
            self._feed(columns, np.arange(1))
            columns, self._begun = select(columns, np.arange(1, len(columns))), True
        for channel, _, frames in by_channel(columns):
            self._take_bus(self._decoder.bus(channel), frames)
            self._board.now_us = max(self._board.now_us, int(frames.at_us.max()))

    def _take_bus(self, bus: BusDecoder, frames: Columns) -> None:
        before = bus.changes
        for row, record in _rows(frames, _that_matter(bus, frames)):
            self._board.take(record, self._decoder.take(record))
            if bus.changes != before:
                self._feed(frames, np.arange(row + 1, len(frames)))
                return

    def _feed(self, frames: Columns, rows: Ints) -> None:
        """Take frames whatever they mean."""
        for _, record in _rows(frames, rows):
            self._board.take(record, self._decoder.take(record))


def _rows(frames: Columns, rows: Ints) -> Iterator[tuple[int, Record]]:
    for begin in range(0, len(rows), _PIECE):
        piece = rows[begin : begin + _PIECE]
        yield from zip(piece.tolist(), records(select(frames, piece)), strict=True)


def _that_matter(bus: BusDecoder, frames: Columns) -> Ints:
    """Return the rows of frames that can change what is known of nodes."""
    can_ids = (frames.ident & STANDARD_MAX).astype(np.int64)
    can_ids[frames.ident & (EXTENDED | ERROR) != 0] = STANDARD_MAX + 1
    effects = np.zeros(STANDARD_MAX + 2, np.uint8)
    for can_id in np.flatnonzero(np.bincount(can_ids)[: STANDARD_MAX + 1]).tolist():
        effects[can_id] = bus.effect(can_id)
    found = effects[can_ids]
    each = np.flatnonzero(found >= Effect.ALONE)
    latest = np.flatnonzero(found == Effect.LATEST)
    if not len(latest):
        return each
    low = frames.payload[each] & np.uint64(0xFF)
    between = np.searchsorted(each[(found[each] == Effect.EACH) | (low == 0)], latest)
    kinds = can_ids[latest] << 5 | (frames.ident[latest] & REMOTE != 0) << 4 | frames.dlc[latest]
    _, last = np.unique((between << 16 | kinds)[::-1], return_index=True)
    return np.sort(np.concatenate((each, latest[::-1][last])))
