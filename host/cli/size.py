"""Sizes as people write them: `4096`, `64k`, `16M`, in powers of 1024."""

from __future__ import annotations

import re
from typing import Final

_SIZE: Final = re.compile(r"([0-9]{1,12})([kKMG])?")
_SHIFT: Final = {"k": 10, "K": 10, "M": 20, "G": 30}


def parse_size(text: str) -> int:
    """Read a size in bytes.

    Raises:
        ValueError: not a size.

    >>> parse_size("4096"), parse_size("64k"), parse_size("16M")
    (4096, 65536, 16777216)
    """
    match = _SIZE.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not a size: write 4096, 64k or 16M")
    return int(match[1]) << _SHIFT.get(match[2], 0)
