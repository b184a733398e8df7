r"""SCIP 1.1, in which a URG-04LX starts: no sums, statuses of one character, distances of two.

Sources: HokuyoAIST, urg_nz (gearbox) and urg_library as hosts; two recordings of real sensors
(`tests/golden/scip_urg_04lx.json`). The document itself is not public any more.

>>> encode_reply(b"L1", OK)
b'L1\n0\n\n'
>>> encode_reply(b"G38438401", OK, encode_distances([1_234]))
b'G38438401\n0\nCB\n\n'
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from tickrig.wire.sensors.scip.encoding import encode_numbers
from tickrig.wire.sensors.scip.scan import BLOCK_BYTES

SWITCH: Final = b"SCIP2.0"
"""The command after which a sensor speaks SCIP 2.0, until it is without power."""

OK: Final = b"0"
ERROR: Final = b"E"
"""What QT is answered with, by which hosts know SCIP 1.1; anything but 0 is an error."""

WIDTH: Final = 2
FARTHEST_MM: Final = 4_095
"""What two characters carry."""


def encode_reply(echo: bytes, status: bytes, lines: Iterable[bytes] = ()) -> bytes:
    """Return the bytes on the line."""
    return b"\n".join((echo, status, *lines)) + b"\n\n"


def encode_distances(distances: Sequence[int]) -> tuple[bytes, ...]:
    """Return the lines of G; FieldError for a number that does not fit."""
    data = encode_numbers(distances, WIDTH)
    return tuple(data[at : at + BLOCK_BYTES] for at in range(0, len(data), BLOCK_BYTES))
