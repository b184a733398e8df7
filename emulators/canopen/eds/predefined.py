"""Defaults of objects whose EDS gives none (CiA 301, pre-defined connection set)."""

from __future__ import annotations

from typing import Final

INVALID: Final = 1 << 31

FIXED: Final = {(0x1005, 0): 0x80, (0x1012, 0): 0x100}
RELATIVE: Final = {
    (0x1014, 0): 0x80,
    (0x1200, 1): 0x600,
    (0x1200, 2): 0x580,
    **{(0x1400 + number, 1): 0x200 + 0x100 * number for number in range(4)},
    **{(0x1800 + number, 1): 0x180 + 0x100 * number for number in range(4)},
}
COB_IDS: Final = (
    (range(0x1201, 0x1300), (1, 2)),
    (range(0x1404, 0x1600), (1,)),
    (range(0x1804, 0x1A00), (1,)),
)
"""Objects that are not valid until somebody gives them a COB-ID, and its sub-indices."""


def predefined(index: int, sub: int) -> tuple[int, bool] | None:
    """Return a default, and whether the node-ID is added to it; None if there is none.

    >>> predefined(0x1800, 1), predefined(0x1809, 1), predefined(0x2000, 0)
    ((384, True), (2147483648, False), None)
    """
    at = (index, sub)
    if at in FIXED:
        return FIXED[at], False
    if at in RELATIVE:
        return RELATIVE[at], True
    invalid = any(index in objects and sub in subs for objects, subs in COB_IDS)
    return (INVALID, False) if invalid else None
