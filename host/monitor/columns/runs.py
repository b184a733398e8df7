"""Frames of a log put together by identifier; needs numpy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]

RADIX_MAX: Final = 0xFFFF
"""numpy sorts 16 bits three times as fast as 32."""


@dataclass(frozen=True, slots=True)
class Runs:
    """Rows sorted by identifier, those of one identifier in their order: a run for each.

    Attributes:
        order: the rows.
        begins: where in `order` each run begins.
        ends: where each ends, one behind its last.
        idents: of each run, ascending.
    """

    order: Ints
    begins: Ints
    ends: Ints
    idents: Ints

    @classmethod
    def of(cls, ident: npt.NDArray[np.uint32] | npt.NDArray[np.uint64]) -> Runs:
        """Sort the rows of a column of identifiers, one row at least."""
        keys: npt.NDArray[Any] = ident.astype(np.uint16) if ident.max() <= RADIX_MAX else ident
        order = np.argsort(keys, kind="stable")
        ordered = ident[order]
        begins = np.flatnonzero(np.diff(ordered, prepend=~ordered[0]))
        ends = np.append(begins[1:], len(ordered))
        return cls(order, begins, ends, ordered[begins].astype(np.int64))

    def gaps_us(self, at_us: Ints) -> Ints:
        """Return the gap before each row of `order`; 0 where a run begins or time goes back."""
        gaps = np.diff(at_us[self.order], prepend=0)
        gaps[self.begins] = 0
        return np.maximum(gaps, 0, out=gaps)

    def sums(self, values: Ints) -> Ints:
        """Add up values, in the order of `order`, run by run."""
        return np.add.reduceat(values, self.begins)
