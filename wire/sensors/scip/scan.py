r"""The data of a scan: time stamp, and distances in blocks of 64 characters, each with its sum.

>>> encode_scan(16_000_000, [5_432], 3)
(b'm2@0?', b'1DhM')
>>> parse_scan((b'm2@0?', b'1DhM'), 3)
(16000000, (5432,))
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tickrig.wire.errors import FramingError
from tickrig.wire.sensors.scip.encoding import (
    encode_number,
    encode_numbers,
    parse_number,
    parse_numbers,
    with_sum,
    without_sum,
)

TIME_WIDTH: Final = 4
BLOCK_BYTES: Final = 64
WIDTHS: Final = {"D": 3, "S": 2}
"""Characters of a distance, by the second letter of the command."""


def encode_scan(time_ms: int, distances: Sequence[int], width: int) -> tuple[bytes, ...]:
    """Return the lines behind the status; FieldError for a number that does not fit."""
    data = encode_numbers(distances, width)
    blocks = [data[at : at + BLOCK_BYTES] for at in range(0, len(data), BLOCK_BYTES)]
    return tuple(with_sum(line) for line in (encode_number(time_ms, TIME_WIDTH), *blocks))


def parse_scan(lines: Sequence[bytes], width: int) -> tuple[int, tuple[int, ...]]:
    """Return time stamp in ms and distances in mm.

    Raises:
        ChecksumError: of a line.
        FramingError: no time stamp, or half a distance.
        FieldError: a character that carries no number.
    """
    stamp, *blocks = [without_sum(line) for line in lines] or [b""]
    data = b"".join(blocks)
    if len(stamp) != TIME_WIDTH:
        raise FramingError(f"{len(stamp)} characters of time, not {TIME_WIDTH}")
    return parse_number(stamp), parse_numbers(data, width)
