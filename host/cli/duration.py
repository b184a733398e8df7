"""Times as people write them: `1.5s`, `200ms`, `250us`; a bare number is seconds."""

from __future__ import annotations

import re
from typing import Final

_TIME: Final = re.compile(r"([0-9]{1,9}(?:\.[0-9]{1,9})?)(s|ms|us)?")
_UNIT_US: Final = {"s": 1_000_000, "ms": 1_000, "us": 1}


def parse_time_us(text: str) -> int:
    """Read a time in microseconds.

    Raises:
        ValueError: not a time.

    >>> parse_time_us("1.5s"), parse_time_us("200ms"), parse_time_us("3")
    (1500000, 200000, 3000000)
    """
    match = _TIME.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is not a time: write 1.5s, 200ms or 250us")
    whole, _, fraction = match[1].partition(".")
    return int(f"{whole}{fraction:0<9}") * _UNIT_US[match[2] or "s"] // 1_000_000_000


def format_time(t_us: int) -> str:
    """Write a time as traces and transcripts do, in seconds.

    >>> format_time(310_000)
    '0.310000'
    """
    return f"{t_us // 1_000_000}.{t_us % 1_000_000:06d}"
