"""How often each payload bit changes, block after block, as in `BitMemory`; needs numpy."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from tickrig.host.canmon.model.columns.columns import Ints
from tickrig.host.canmon.model.columns.runs import Runs, grown
from tickrig.host.canmon.model.traffic.tally import PAYLOAD_BITS, BitRow

Payloads = npt.NDArray[np.uint64]

BYTES: Final = 8
ADDED: Final = 255
"""So many bits are added up in a byte."""

_SPREAD: Final = (
    np.unpackbits(np.arange(256, dtype=np.uint8)[:, np.newaxis], axis=1, bitorder="little")
    .view("<u8")[:, 0]
    .astype(np.uint64)
)
"""The bits of each byte, a byte of a word each."""


class ColumnChanges:
    """Counts the changes of each bit of each identifier of a bus.

    A payload that is shorter than the one before counts as filled up with zeros.

    Attributes:
        payload: the latest of each.
    """

    def __init__(self) -> None:
        self.payload, self._latest = np.empty(0, np.uint64), np.empty(0, np.uint64)
        self._counts = np.empty((0, PAYLOAD_BITS), np.int64)

    def take(self, runs: Runs, payload: Payloads, count: int) -> None:
        """Compare the payloads of a block; there are `count` identifiers now."""
        self.payload, self._latest = grown(self.payload, count), grown(self._latest, count)
        self._counts = grown(self._counts, count)
        ordered = payload[runs.order]
        changes = ordered ^ np.roll(ordered, 1)
        across = ordered[runs.begins] ^ self.payload[runs.numbers]
        changes[runs.begins] = np.where(runs.fresh, np.uint64(0), across)
        self.payload[runs.numbers] = ordered[runs.ends - 1]
        self._latest[runs.numbers] = changes[runs.ends - 1]
        self._add(runs, changes)

    def rows(self) -> list[BitRow]:
        """Return what changed in each identifier."""
        planes, latest = _planes(self._counts), self._latest.tolist()
        return [BitRow(*row) for row in zip(latest, planes, strict=True)]

    def _add(self, runs: Runs, changes: Payloads) -> None:
        """Add up each byte's bits side by side: as many rows at once as a byte can count."""
        begins, pieces = _pieces(runs)
        octets = changes.astype("<u8").view(np.uint8).reshape(-1, BYTES)
        for place in range(BYTES):
            column = octets[:, place]
            if column.any():
                words = np.add.reduceat(_SPREAD[column], begins)
                counts = words.astype("<u8").view(np.uint8).reshape(-1, 8).astype(np.int64)
                bits = slice(8 * place, 8 * place + 8)
                self._counts[runs.numbers, bits] += np.add.reduceat(counts, pieces, axis=0)


def _pieces(runs: Runs) -> tuple[Ints, Ints]:
    """Cut runs; return where each piece begins, and the first piece of each run."""
    counts = -(-runs.lengths // ADDED)
    firsts = np.cumsum(counts) - counts
    nth = np.arange(int(counts.sum())) - np.repeat(firsts, counts)
    return np.repeat(runs.begins, counts) + nth * ADDED, firsts


def _planes(counts: Ints) -> list[tuple[int, ...]]:
    most = [int(row).bit_length() for row in counts.max(axis=1)]
    stacked = [
        np.packbits((counts >> place & 1).astype(np.uint8), axis=1, bitorder="little")
        .view("<u8")[:, 0]
        .tolist()
        for place in range(max(most, default=0))
    ]
    return [tuple(plane[run] for plane in stacked[:depth]) for run, depth in enumerate(most)]
