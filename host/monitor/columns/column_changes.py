"""Which payload bits change in a log, as `BitMemory` counts them; needs numpy."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from tickrig.host.monitor.columns.runs import Ints, Runs
from tickrig.host.monitor.traffic.bits import BitRow

BYTES: Final = 8
_BITS: Final = np.unpackbits(
    np.arange(256, dtype=np.uint8)[:, np.newaxis], axis=1, bitorder="little"
).astype(np.int64)
"""The bits of each byte."""


def column_changes(runs: Runs, payload: npt.NDArray[np.uint64]) -> list[BitRow]:
    """Return what changed in each run.

    Args:
        runs: frames by identifier.
        payload: of each row of the log.
    """
    ordered = payload[runs.order]
    changes = ordered ^ np.roll(ordered, 1)
    changes[runs.begins] = 0
    planes = _planes(_counts(runs, changes))
    latest = changes[runs.ends - 1].tolist()
    return [BitRow(one, planes[run]) for run, one in enumerate(latest)]


def _counts(runs: Runs, changes: npt.NDArray[np.uint64]) -> Ints:
    """Return how often each bit changed in each run: count the values of each byte first."""
    counts = np.zeros((len(runs.begins), 8 * BYTES), np.int64)
    run = np.repeat(np.arange(len(runs.begins)) << 8, runs.ends - runs.begins)
    octets = changes.astype("<u8").view(np.uint8).reshape(-1, BYTES)
    for place in range(BYTES):
        column = octets[:, place]
        if column.any():
            values = np.bincount(run + column, minlength=counts.shape[0] << 8)
            counts[:, 8 * place : 8 * place + 8] = values.reshape(-1, 256) @ _BITS
    return counts


def _planes(counts: Ints) -> list[tuple[int, ...]]:
    most = [int(row).bit_length() for row in counts.max(axis=1)]
    stacked = [
        np.packbits((counts >> place & 1).astype(np.uint8), axis=1, bitorder="little")
        .view("<u8")[:, 0]
        .tolist()
        for place in range(max(most))
    ]
    return [tuple(plane[run] for plane in stacked[:depth]) for run, depth in enumerate(most)]
